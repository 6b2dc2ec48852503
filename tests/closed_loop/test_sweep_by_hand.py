"""`rig sweep` at a terminal with a person for a stage; the simulated board follows the hand."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.browser import driven_browser
from tests.support.small_sim import SMALL_SIM, as_options
from tests.support.terminal import LONGEST_S, typed

DISTANCES_MM = ("400.0", "470.0", "560.0", "700.0", "850.0", "1000.0")
HAND = '[stage]\nkind = "manual"\ntravel_mm = [400.0, 1200.0]\n'


def profile_by_hand(folder: Path) -> Path:
    text = (Path(__file__).parents[2] / "calib_profiles/sim.toml").read_text()
    path = folder / "hand.toml"
    path.write_text(re.sub(r"(?ms)^\[stage\]\n.*?(?=^\[)", HAND + "\n", text))
    return path


@pytest.mark.slow
def test_the_verb_says_where_and_waits_for_enter(tmp_path: Path) -> None:
    profile = profile_by_hand(tmp_path)
    said, code = typed(
        [
            *(sys.executable, "-m", "rig", "sweep", str(profile)),
            *("--db", f"sqlite:///{tmp_path}/sweeps.db", "--samples", "1"),
            *("--at-mm", ",".join(DISTANCES_MM)),
            *as_options((*SMALL_SIM, "sweep.backward_every=0")),
        ],
        ("press Enter",),
        None,
        tmp_path,
    )
    asked = re.findall(r"Put the board at ([\d.]+) mm and press Enter", said)
    assert asked == list(DISTANCES_MM)
    assert "[6/6] 1000.0 mm forward, sample 1" in said
    assert code == 0, said
    assert re.search(r"focus distance (699\.9|700\.0)", said), said


@pytest.fixture
def browser() -> Iterator[Any]:
    with driven_browser() as one:
        yield one


@pytest.mark.slow
def test_the_page_says_where_and_its_button_confirms(browser: Any, tmp_path: Path) -> None:
    command = [
        *(sys.executable, "-m", "rig", "sweep", str(profile_by_hand(tmp_path)), "--view"),
        *("--db", f"sqlite:///{tmp_path}/sweeps.db", "--samples", "1"),
        *("--at-mm", ",".join(DISTANCES_MM)),
        *as_options((*SMALL_SIM, "sweep.backward_every=0")),
    ]
    environment = {**os.environ, "CI": "true"}  # no other browser
    log = tmp_path / "log"
    page = browser.new_page(viewport={"width": 1000, "height": 800})
    with (
        log.open("w") as err,
        subprocess.Popen(
            command, cwd=tmp_path, stdin=subprocess.DEVNULL, stdout=err, stderr=err, env=environment
        ) as running,
    ):
        try:
            page.goto(until(lambda: re.search(r"live page: (\S+)", log.read_text()))[1])
            for place, distance_mm in enumerate(DISTANCES_MM):
                page.wait_for_selector(f"#ask-text:has-text('Put the board at {distance_mm} mm')")
                assert page.evaluate("() => document.activeElement.id") == "reading"
                if place == 1:
                    page.fill("#reading", "300")
                    page.keyboard.press("Enter")
                    page.wait_for_selector("#ask-text:has-text('put it nearer')")
                    page.screenshot(path=tmp_path / "asked.png")
                if place % 2:
                    page.keyboard.press("Enter")
                else:
                    page.click("#put")
            assert running.wait(LONGEST_S) == 0, log.read_text()
        finally:
            running.kill()
    page.close()
    assert re.search(r"focus distance (699\.9|700\.0)", log.read_text()), log.read_text()


def until(found: Callable[[], re.Match[str] | None]) -> re.Match[str]:
    for _ in range(600):
        if (match := found()) is not None:
            return match
        time.sleep(0.1)
    pytest.fail("the page's address was never told")
