"""Verbs ended at random moments: a part of `python -m benchmarks.kills`."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def play(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "benchmarks.kills", "--seed", "7", *words],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
        timeout=560,
    )


@pytest.mark.parametrize(
    ("verb", "count"),
    [("sweep", 3), ("calibrate", 2), ("capture", 3), ("fit", 3), ("backup", 4), ("migrate", 5)],
)
def test_what_was_killed_goes_on_and_nothing_is_lost(verb: str, count: int):
    played = play("--verb", verb, "--count", str(count))
    assert played.returncode == 0, played.stdout + played.stderr
    assert played.stdout.startswith(f"seed 7: {verb}: {count} rounds, ended ")
    assert played.stdout.endswith("; 0 broken promises\n")


def test_what_is_told_to_end_says_what_was_saved():
    played = play("--signals", "--verb", "backup", "--verb", "fit", "--count", "3")
    assert played.returncode == 0, played.stdout + played.stderr
    assert played.stdout.count("; 0 broken promises") == 2
