"""The page of a calibration, over a solve of a scene with known truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.errors import StoreError
from rig.geometry.bundle import solve_rig
from rig.geometry.bundle.result import Calibration, Reason, Verdict
from rig.report.calibration.parameters import parameter_rows
from rig.report.calibration.shown import ShownCalibration
from rig.report.write import write_calibration_page
from tests.support.calibration_scene import HEIGHT, WIDTH, flat_board_mm, random_scene
from tests.unit.report.test_write import Page, header, section

pytestmark = pytest.mark.xdist_group("calibration page")

NAMES = ("centre", "right", "below")
PICTURES = 12


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    sightings = random_scene(3, PICTURES).sightings(3)
    return solve_rig(sightings, flat_board_mm(), [(WIDTH, HEIGHT)] * 3, NAMES, 0, lens="brown5")


@pytest.fixture(scope="module")
def shown(calibration: Calibration) -> ShownCalibration:
    grey = np.random.default_rng(1).integers(90, 110, (HEIGHT, WIDTH)).astype(np.uint8)
    images = {(picture, view): grey for picture in range(0, PICTURES, 2) for view in range(3)}
    return ShownCalibration("bench <1>", calibration, images, {"camera": {"serial": "A&B"}})


@pytest.fixture(scope="module")
def html(tmp_path_factory: pytest.TempPathFactory, shown: ShownCalibration) -> str:
    return page_of(tmp_path_factory.mktemp("page") / "page.html", shown)


def page_of(path: Path, shown: ShownCalibration) -> str:
    return write_calibration_page(path, shown).read_text(encoding="utf-8")


def test_the_page_shows_every_picture_an_engineer_knows(html: str) -> None:
    page = Page(html)
    assert len(page.ids) == len(set(page.ids))
    assert all(link.startswith(("#", "data:")) for link in page.fetched)
    assert page.tags.count("svg") == 7
    for words in ("found", "reprojected", "point 0 of the board", "held out", "k=2, % of depth",
                  "boards, seen by the rig", "rig, seen by the board"):  # fmt: skip
        assert words in html
    assert "picture 0, centre" in html
    assert "picture 10, below" in html
    assert "picture 6, centre" not in html  # three multi-views are enough
    assert "bench &lt;1&gt;" in html
    assert "A&amp;B" in html


def test_the_headline_is_depth(html: str, shown: ShownCalibration) -> None:
    at_1_m = next(e for e in shown.calibration.depth_error if e.distance_mm == 1000.0)
    assert f"{at_1_m.seen_pct:.2g}"[:4] in header(html)
    assert "0.5 m" in section(html, "What it means for depth")
    assert f"{shown.calibration.rms_px:.3f}" in section(html, "How well the pictures fit")


@pytest.mark.slow
def test_the_same_calibration_gives_the_same_bytes(
    tmp_path: Path, html: str, shown: ShownCalibration
) -> None:
    assert page_of(tmp_path / "again.html", shown) == html


@pytest.mark.slow
def test_a_weak_calibration_says_why(tmp_path: Path, shown: ShownCalibration) -> None:
    verdict = Verdict((Reason("square-on", "all boards square-on; tilt them"),), (), ())
    weak = replace(shown, calibration=replace(shown.calibration, verdict=verdict), images={})
    html = page_of(tmp_path / "weak.html", weak)
    assert "WEAK" in header(html)
    assert "tilt them" in header(html)
    assert "Circles" not in html


@pytest.mark.slow
def test_a_geometry_without_covariance_promises_nothing(
    tmp_path: Path, shown: ShownCalibration
) -> None:
    bare = replace(
        shown.calibration,
        geometry=replace(shown.calibration.geometry, covariance=None),
        depth_error=(),
    )
    html = page_of(tmp_path / "bare.html", replace(shown, calibration=bare))
    assert "depth error unknown" in header(html)
    assert "nobody knows the error of depth" in section(html, "What it means for depth")


def test_parameters_stand_beside_their_own_uncertainty(calibration: Calibration) -> None:
    geometry = calibration.geometry
    assert geometry.covariance is not None
    rows = {row.name: row for row in parameter_rows(geometry)}
    sigma = np.sqrt(np.diag(geometry.covariance))
    places = [0, 9, 18]  # fx of each view: four intrinsics and five coefficients
    for text, place in zip(rows["fx"].values, places, strict=True):
        assert float(text.partition("±")[2]) == pytest.approx(2.0 * sigma[place], rel=0.06)
    assert rows["tx"].values[0] == "–"
    tx = rows["tx"].values[1]
    assert float(tx.partition("±")[0]) == pytest.approx(
        geometry.cam_from_reference[1].translation_mm[0], abs=0.01
    )
    assert float(tx.partition("±")[2]) == pytest.approx(2.0 * sigma[27 + 3], rel=0.06)


@pytest.mark.slow
def test_a_missing_folder_is_a_store_error(tmp_path: Path, shown: ShownCalibration) -> None:
    with pytest.raises(StoreError, match="write the report"):
        write_calibration_page(tmp_path / "nowhere" / "page.html", shown)
