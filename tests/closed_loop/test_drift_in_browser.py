"""The drift of the views on the live page: what it draws is what the looks have told."""

from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.drift_series import DriftSeries
from rig.records import StoredDrift
from rig.view.frame_message import FrameMessage
from rig.view.live_view import LiveView
from rig.view.notices import Notices
from rig.view.server import ViewServer
from tests.closed_loop.test_page_in_browser import SCENE, Bench
from tests.support.browser import driven_browser

pytestmark = pytest.mark.slow

BEGAN = datetime(2026, 11, 2, 8, tzinfo=UTC)


def look(number: int, *, degc: float | None) -> StoredDrift:
    """Both views turn: left pitches by a thousandth of a degree a look, right rolls back."""
    details = {
        "turned_deg": {"left": [0.001 * number, 0.0, 0.004], "right": [0.0, 0.0, -0.002 * number]},
        "sigma_deg": {"left": [0.001, 0.1, 0.002], "right": [0.0015, 0.1, 0.001]},
        "probability": 0.3,
    }
    at = BEGAN + timedelta(seconds=30 * number)
    return StoredDrift(number, "bench", 3, at, degc, details)


def series(count: int, *, is_warm: bool) -> DriftSeries:
    looks = tuple(
        look(k, degc=31.0 + 6.0 * (1.0 - float(np.exp(-k / 12.0))) if is_warm else None)
        for k in range(1, count + 1)
    )
    return DriftSeries(3, BEGAN, 31.0, {"left": (0.002, 0.003), "right": (0.002, 0.003)}, looks)


class Drifting(Bench):
    """A bench whose cameras are looked at."""

    told: DriftSeries | None = None


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with driven_browser() as one:
        yield one


@pytest.fixture(params=["light", "dark"])
def bench(browser: Any, request: pytest.FixtureRequest) -> Iterator[Drifting]:
    server = ViewServer[FrameMessage]("127.0.0.1", 0, "t", Notices(lambda _: None)).start()
    page = browser.new_page(viewport={"width": 1280, "height": 900}, color_scheme=request.param)
    one: Drifting
    view = LiveView(SCENE.run, lambda: {}, server, drift=lambda: one.told)
    one = Drifting(view, server, page)
    page.on("pageerror", lambda error: one.errors.append(str(error)))
    page.on("console", lambda said: one.errors.append(said.text) if said.type == "error" else None)
    with closing(view):
        page.goto(server.url)
        yield one
        assert one.errors == []
        page.close()


def shown(bench: Drifting, index: int, count: int) -> None:
    """Show frames until the page has the series: it asks for it once it knows of looks."""
    bench.show(SCENE.frame(index))
    bench.show(SCENE.frame(index + 1))
    bench.wait(
        f"() => document.getElementById('drift-hint').textContent.startsWith('{count} look')"
    )


def test_where_nobody_looks_there_is_no_panel(bench: Drifting):
    bench.show(SCENE.frame(0))
    assert bench.page.locator("#p-drift").is_hidden()


def test_before_the_first_look_it_says_when_that_comes(bench: Drifting):
    bench.told = series(0, is_warm=False)
    bench.show(SCENE.frame(0))
    bench.show(SCENE.frame(1))
    bench.wait(
        "() => document.getElementById('drift-hint').textContent.startsWith('The first look comes')"
    )
    assert bench.page.locator("#drifts figure").count() == 0


def test_every_view_has_its_turn_and_its_band(bench: Drifting):
    bench.told = series(40, is_warm=True)
    shown(bench, 0, 40)
    texts = bench.page.locator("#drifts figcaption").all_inner_texts()
    assert [text.split()[0] for text in texts] == ["left", "right"]
    assert "pitch +0.040 ± 0.002°" in texts[0]
    assert "roll −0.080 ± 0.002°" in texts[1]
    assert "+5.8 °C since then" in bench.page.inner_text("#drift-hint")
    assert (picture(bench)[..., 3] > 0).mean() > 0.05
    bench.told = bench.told.joined(look(41, degc=36.9))
    shown(bench, 10, 41)
    assert "pitch +0.041" in bench.page.locator("#drifts figcaption").first.inner_text()


def test_it_is_drawn_against_temperature_where_the_camera_tells_one(bench: Drifting):
    bench.told = series(40, is_warm=True)
    shown(bench, 0, 40)
    by_time = picture(bench)
    bench.page.click("#drift-by")
    bench.wait("() => !window.rig.app.pending")
    assert bench.page.get_attribute("#drift-by", "aria-pressed") == "true"
    assert not np.array_equal(picture(bench), by_time)
    bench.told = series(41, is_warm=False)
    shown(bench, 10, 41)
    assert bench.page.locator("#drift-by").is_hidden()


def test_it_fits_a_telephone(bench: Drifting):
    bench.page.set_viewport_size({"width": 390, "height": 844})
    bench.told = series(300, is_warm=True)
    shown(bench, 0, 300)
    box = bench.page.locator("#p-drift").bounding_box()
    assert box["x"] >= 0.0
    assert box["x"] + box["width"] <= 390.0
    assert bench.page.evaluate("() => document.documentElement.scrollWidth") <= 390


def picture(bench: Drifting) -> NDArray[np.uint8]:
    """What is drawn of the first view, (H, W, 4)."""
    bench.page.evaluate("() => { document.querySelector('#drifts canvas').id = 'first-drift'; }")
    return bench.pixels("first-drift")
