"""The browser that pages are looked at with; without one their tests are skipped."""

import shutil
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FLAGS = (
    "--no-sandbox",
    "--disable-quic",
    "--disable-background-networking",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
)


def browser_there() -> str:
    """Return the path of a browser."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip(f"no browser here (looked for {', '.join(NAMES)}); apt-get install chromium")
    return found


@contextmanager
def driven_browser() -> Generator[Any]:
    """Start a browser that draws without a graphics card, driven by Playwright."""
    playwright = pytest.importorskip("playwright.sync_api")
    path = browser_there()
    with playwright.sync_playwright() as driver:
        one = driver.chromium.launch(executable_path=path, args=list(_FLAGS))
        yield one
        one.close()
