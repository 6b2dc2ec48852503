"""`rig sweep` at a terminal with a person for a stage; the simulated board follows the hand."""

import os
import pty
import re
import select
import sys
import time
from pathlib import Path

import pytest

from tests.support.small_sim import SMALL_SIM, as_options

DISTANCES_MM = ("400.0", "470.0", "560.0", "700.0", "850.0", "1000.0")
LONGEST_S = 300.0
HAND = '[stage]\nkind = "manual"\ntravel_mm = [400.0, 1200.0]\n'


def profile_by_hand(folder: Path) -> Path:
    text = (Path(__file__).parents[2] / "calib_profiles/sim.toml").read_text()
    path = folder / "hand.toml"
    path.write_text(re.sub(r"(?ms)^\[stage\]\n.*?(?=^\[)", HAND + "\n", text))
    return path


def at_a_terminal(arguments: list[str]) -> tuple[str, int]:
    """Run a program on a pseudo-terminal, press Enter whenever it asks; returns output and code."""
    pid, terminal = pty.fork()
    if pid == 0:
        os.execv(arguments[0], arguments)  # noqa: S606
    said, pressed, deadline_s = b"", 0, time.monotonic() + LONGEST_S
    while time.monotonic() < deadline_s:
        if not select.select([terminal], [], [], 1.0)[0]:
            continue
        try:
            came = os.read(terminal, 4096)
        except OSError:  # the other end is closed
            break
        said += came
        while pressed < said.count(b"press Enter"):
            os.write(terminal, b"\n")
            pressed += 1
    os.close(terminal)
    return said.decode(errors="replace"), os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


@pytest.mark.slow
def test_the_verb_says_where_and_waits_for_enter(tmp_path: Path) -> None:
    profile = profile_by_hand(tmp_path)
    said, code = at_a_terminal(
        [
            *(sys.executable, "-m", "rig", "sweep", str(profile)),
            *("--db", f"sqlite:///{tmp_path}/sweeps.db", "--samples", "1"),
            *("--at-mm", ",".join(DISTANCES_MM)),
            *as_options((*SMALL_SIM, "sweep.backward_every=0")),
        ]
    )
    asked = re.findall(r"Put the board at ([\d.]+) mm and press Enter", said)
    assert asked == list(DISTANCES_MM)
    assert "[6/6] 1000.0 mm forward, sample 1" in said
    assert code == 0, said
    assert re.search(r"focus distance (699\.9|700\.0)", said), said
