"""The report as a browser shows it."""

import re
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.report import write_report
from tests.support.browser import browser_there
from tests.support.sweeps import SweepRecipe, stored_sweep

pytestmark = pytest.mark.slow

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
    "--hide-scrollbars",
    "--enable-logging=stderr",
    "--window-size=1000,7000",
)
FIGURES = {
    "Slope against distance",
    "Residuals of every model",
    "Depth error at held-out distances",
    "Scatter, direction and stillness of every stop",
    "Three estimators of one slope",
    "Corners found in the reference view",
    "Epipolar-plane images with fitted lines",
    "Pictures without a slope",
    "Temperature of the camera",
}


@pytest.fixture(scope="module")
def browser() -> str:
    return browser_there()


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    recipe = SweepRecipe(holdout_every=3, fails_at_mm=(920.0,), rise_degc=1.0)
    store, result = stored_sweep(tmp_path_factory.mktemp("sweep"), recipe)
    with store:
        return write_report(store, result)


def run(browser: str, user_data: Path, report: Path, *flags: str) -> tuple[str, str]:
    """Open the report; return standard output and what the page's console says."""
    done = subprocess.run(
        [browser, *FLAGS, f"--user-data-dir={user_data}", *flags, report.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    console = "\n".join(line for line in done.stderr.splitlines() if "CONSOLE" in line)
    return done.stdout, console


def test_a_browser_builds_the_whole_page_and_asks_for_nothing(
    browser: str, report: Path, tmp_path: Path
) -> None:
    dom, console = run(browser, tmp_path / "user", report, "--dump-dom")
    # The page's own policy forbids every request; a browser that had to stop one would say so.
    assert "default-src 'none'" in dom
    assert console == ""
    assert set(re.findall(r'<svg role="img" aria-label="([^"]+)"', dom)) == FIGURES
    assert len(re.findall(r"<image [^>]*data:image/png", dom)) >= 3 * 2 + 3 * 2 * 3 + 1
    assert len(re.findall(r"<h2>", dom)) == 9
    assert dom.rstrip().endswith("</html>")


def test_a_browser_shows_text_plots_and_photographs(
    browser: str, report: Path, tmp_path: Path
) -> None:
    shot = tmp_path / "report.png"
    run(browser, tmp_path / "user", report, f"--screenshot={shot}")
    picture = cv2.imread(str(shot))
    assert picture is not None
    page = picture.astype(np.int16)
    ink = np.any(page < 240, axis=2)
    rows = np.flatnonzero(ink.any(axis=1))
    assert rows[-1] - rows[0] > 4000
    # Nothing sticks out of the text column, 48 rem wide.
    columns = np.flatnonzero(ink.any(axis=0))
    assert columns[0] > 100
    assert columns[-1] < 900
    for name, rgb in {"blue": (0, 114, 178), "vermillion": (213, 94, 0)}.items():
        near = np.all(np.abs(page[..., ::-1] - rgb) < 12, axis=2)
        assert near.sum() > 500, name
    # Photographs: many grey levels on one row, which lines and letters do not have.
    levels = max(np.unique(row).size for row in page[::5, :, 0])
    assert levels > 60
