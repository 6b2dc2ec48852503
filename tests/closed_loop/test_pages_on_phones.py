"""Every page on a phone, in the dark, and on paper, as a browser lays it out."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.cli.compare import compare
from rig.geometry.bundle import solve_rig
from rig.report import write_report
from rig.report.calibration.shown import ShownCalibration
from rig.report.write import write_calibration_page
from tests.support.browser import driven_browser
from tests.support.calibration_scene import HEIGHT, WIDTH, flat_board_mm, random_scene
from tests.support.sweeps import SweepRecipe, stored_sweep

pytestmark = pytest.mark.slow

PAGES = ("sweep", "calibration", "compare")
BEYOND = """() => [...document.querySelectorAll("body *:not(svg *)")]
    .filter((e) => e.getBoundingClientRect().right > innerWidth + 1)
    .map((e) => e.outerHTML.slice(0, 80))"""
COLOURS = """() => [getComputedStyle(document.body).backgroundColor,
    getComputedStyle(document.body).color]"""
FIRST_CELL = """() => {
    const cell = document.querySelector("[id^=cards-] td");
    return [getComputedStyle(cell).display, getComputedStyle(cell, "::before").content];
}"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("pages")
    recipe = SweepRecipe(fails_at_mm=(470.0, 920.0), rise_degc=1.0, note="n" * 200)
    store, result = stored_sweep(made, recipe)
    with store:
        write_report(store, result).rename(made / "sweep.html")
    board, names = flat_board_mm(), ("centre", "right", "below")
    sightings = random_scene(3, 12).sightings(3)
    solved = solve_rig(sightings, board, [(WIDTH, HEIGHT)] * 3, names, 0, lens="brown5")
    grey = np.full((HEIGHT, WIDTH), 100, np.uint8)
    images = {(picture, view): grey for picture in range(4) for view in range(3)}
    shown = ShownCalibration("bench", solved, images, {"camera": {"serial": "A" * 90}})
    write_calibration_page(made / "calibration.html", shown)
    files = ", ".join(f'{frame} = "{frame}.png"' for frame in _first_sample(made))
    camera = f'camera={{kind="folder", folder="{_sample_folder(made)}", files={{{files}}}}}'
    compare(
        "sim",
        frames=1,
        slopes_only=True,
        out=made / "out",
        overrides=[camera, "slopes.range_px=[-9.0, 15.0]"],
        database=f"sqlite:///{made / 'rig.sqlite'}",
        as_json=True,
    )
    (made / "out" / "compare.html").rename(made / "compare.html")
    return made


def _sample_folder(made: Path) -> Path:
    return next(made.glob("frames/*/*/stop_*/sample_*"))


def _first_sample(made: Path) -> list[str]:
    return [file.stem for file in sorted(_sample_folder(made).glob("*.png"))]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with driven_browser() as one:
        yield one


def shown(browser: Any, page: Path, width: int, scheme: str) -> Any:
    context = browser.new_context(
        viewport={"width": width, "height": 740}, color_scheme=scheme, java_script_enabled=True
    )
    tab = context.new_page()
    tab.goto(page.as_uri())
    return tab


@pytest.mark.parametrize("name", PAGES)
def test_a_phone_never_scrolls_sideways(browser: Any, folder: Path, name: str):
    tab = shown(browser, folder / f"{name}.html", 360, "light")
    assert tab.evaluate("() => document.documentElement.scrollWidth") == 360
    assert tab.evaluate(BEYOND) == []
    display, column = tab.evaluate(FIRST_CELL)
    assert display == "flex"
    assert len(column) > 4
    tab.emulate_media(media="print")
    assert tab.evaluate(FIRST_CELL)[0] == "table-cell"
    tab.context.close()


@pytest.mark.parametrize("name", PAGES)
def test_the_dark_page_is_dark_and_paper_is_white(browser: Any, folder: Path, name: str):
    tab = shown(browser, folder / f"{name}.html", 1000, "dark")
    dark = ["rgb(22, 22, 22)", "rgb(228, 228, 228)"]
    assert tab.evaluate(COLOURS) == dark
    axes = '() => getComputedStyle(document.querySelector("figure svg #FIRST path")).fill'
    first = tab.evaluate('() => document.querySelector("figure svg [id$=patch_1]").id')
    assert tab.evaluate(axes.replace("FIRST", first)) == "rgb(22, 22, 22)"
    tab.emulate_media(media="print")
    assert tab.evaluate(COLOURS) == ["rgb(255, 255, 255)", "rgb(26, 26, 26)"]
    assert tab.evaluate(axes.replace("FIRST", first)) == "rgb(255, 255, 255)"
    tab.context.close()
