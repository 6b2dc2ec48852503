"""`rig sweep` at a terminal with a person for a stage; the simulated board follows the hand."""

import re
import sys
from pathlib import Path

import pytest

from tests.support.small_sim import SMALL_SIM, as_options
from tests.support.terminal import typed

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
