import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from rig.errors import ConfigError, StoreError
from rig.report import write, write_report
from tests.unit.report.conftest import Reported


class Page(HTMLParser):
    """Collects what a browser would fetch, ids, and whether every element is closed."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.ids: list[str] = []
        self.tags: list[str] = []
        self._open: list[str] = []
        self.feed(html)
        assert not self._open, f"left open: {self._open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_startendtag(tag, attrs)
        if tag not in {"meta", "link", "img", "br", "hr"}:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value or "")
            elif name in {"src", "href", "xlink:href", "srcset", "data", "action"}:
                self.fetched.append(value or "")

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag


def section(html: str, title: str) -> str:
    """Text of one section without tags."""
    found = re.search(rf"</span>{title}</h2>(.*?)(?=<h2>|</body>)", html, re.DOTALL)
    assert found is not None, title
    return re.sub(r"\s+", " ", re.sub(r"<svg.*?</svg>|<[^>]+>", " ", found[1], flags=re.DOTALL))


def header(html: str) -> str:
    found = re.search(r"<header>(.*?)</header>", html, re.DOTALL)
    assert found is not None
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", found[1]))


@pytest.mark.parametrize("name", ["good", "bad", "least"])
def test_the_page_is_well_formed_and_needs_nothing_else(
    name: str, request: pytest.FixtureRequest
) -> None:
    html: str = request.getfixturevalue(name).html
    page = Page(html)
    outside = [link for link in page.fetched if not link.startswith(("#", "data:image/png;"))]
    assert outside == []
    assert "script" not in page.tags
    assert "link" not in page.tags
    assert not re.search(r"@import|url\((?!#)", html)
    addresses = set(re.findall(r"https?://[^\s\"'<]+", re.sub(r'xmlns(:\w+)?="[^"]*"', "", html)))
    assert addresses == set()


@pytest.mark.parametrize("name", ["good", "bad", "least"])
def test_ids_of_all_figures_differ_and_every_reference_has_its_target(
    name: str, request: pytest.FixtureRequest
) -> None:
    html: str = request.getfixturevalue(name).html
    page = Page(html)
    assert len(page.ids) == len(set(page.ids))
    inside = {link[1:] for link in page.fetched if link.startswith("#")}
    inside |= set(re.findall(r"url\(#([^)]+)\)", html))
    assert inside <= set(page.ids)


def test_the_headline_is_the_verdict_of_the_sweep(good: Reported) -> None:
    top = header(good.html)
    assert str(good.result.headline).replace("+-", "±") in top
    assert "PASS" in top
    assert "FAIL" not in top
    assert good.result.fit.holdout is not None
    assert f"{good.result.fit.holdout.rms_pct:.4f} %" in top


def test_missed_gates_say_so_and_what_to_do(bad: Reported) -> None:
    top = header(bad.html)
    assert "PASS" not in top
    assert len(bad.result.failed_gates) == 3
    assert top.count("FAIL") == 1 + 3
    assert "What to do" in top
    assert "stop 3 at 640.0 mm (forward): asked for a board of 9 x 6" in top


def test_a_stop_without_slope_is_shown_with_its_reason(bad: Reported) -> None:
    assert 'aria-label="Pictures without a slope"' in bad.html
    assert "found &lt;none&gt;; add light" in section(bad.html, "Corners found")
    assert "640.0" in section(bad.html, "Every stop")


def test_text_of_users_and_devices_is_escaped(good: Reported, bad: Reported) -> None:
    assert "&lt;b&gt;bold &amp; loud&lt;/b&gt;" in good.html
    assert "none &lt;drawn&gt;" in good.html
    assert not re.search(r"<b>|<drawn>|<none>", good.html + bad.html)


def test_what_is_missing_is_said(least: Reported) -> None:
    assert "depth error unknown" in header(least.html)
    assert "unknown" in section(least.html, "Error at held-out distances")
    repeatability = section(least.html, "Repeatability")
    assert "one sample: its scatter is not known" in repeatability
    assert "both directions" in repeatability
    assert "not fitted: " in section(least.html, "Residuals of every model")
    assert 'aria-label="Depth error at held-out distances"' not in least.html


def test_every_stop_has_its_row(good: Reported) -> None:
    stops = section(good.html, "Every stop")
    for stop in good.result.stops:
        assert stop.point is not None
        assert f"{stop.point.distance_mm:.3f}" in stops
        assert f"{stop.point.slope_px:.4f}" in stops


def test_a_temperature_is_drawn_only_where_it_varies(good: Reported, bad: Reported) -> None:
    assert 'aria-label="Temperature of the camera"' in bad.html
    assert 'aria-label="Temperature of the camera"' not in good.html
    assert "25.0 °C at the start, 27.0 °C at the end" in section(
        bad.html, "Identity and provenance"
    )


@pytest.mark.slow
def test_the_same_sweep_gives_the_same_bytes(least: Reported) -> None:
    again = write_report(least.store, least.result)
    assert again.read_text(encoding="utf-8") == least.html


def test_what_cannot_be_put_in_place_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "report.html" / "full").mkdir(parents=True)
    with pytest.raises(StoreError, match="cannot write the report"):
        write._write(tmp_path / "report.html", "text")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.slow
def test_a_missing_folder_is_a_store_error(least: Reported) -> None:
    gone = least.result.report.parent / "gone" / "report.html"
    with pytest.raises(StoreError, match=r"gone/report\.html: cannot write the report"):
        write_report(least.store, replace(least.result, report=gone))


@pytest.mark.parametrize("package", ["matplotlib", "jinja2"])
def test_a_missing_extra_is_named(
    package: str, least: Reported, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in list(sys.modules):
        plots = name.startswith("rig.report.") and name != "rig.report.write"
        if plots or name.partition(".")[0] == package:
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ConfigError, match=rf"{package} is not installed; pip install 'epirig\[re"):
        write_report(least.store, least.result)


def test_importing_the_report_is_cheap() -> None:
    code = "import sys, rig.report; print(*{'matplotlib', 'jinja2', 'numba'} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
