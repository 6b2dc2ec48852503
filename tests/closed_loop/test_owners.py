"""Several programs at one thing, some killed: a fiftieth of `python -m benchmarks.owners`."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
def test_of_several_programs_one_is_the_owner_and_nothing_is_lost():
    played = subprocess.run(
        [sys.executable, "-m", "benchmarks.owners", "--count", "4", "--seed", "7"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
        timeout=280,
    )
    assert played.returncode == 0, played.stdout + played.stderr
    assert played.stdout.startswith("seed 7: 4 rounds, ")
    assert played.stdout.endswith(", 0 broken promises\n")
