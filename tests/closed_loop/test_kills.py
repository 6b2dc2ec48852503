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


def test_what_was_killed_goes_on_and_nothing_is_lost():
    verbs = ("backup", "calibrate", "capture", "fit", "migrate", "sweep")
    played = play("--count", "1", *(word for verb in verbs for word in ("--verb", verb)))
    assert played.returncode == 0, played.stdout + played.stderr
    for verb, line in zip(verbs, played.stdout.splitlines(), strict=True):
        assert line.startswith(f"seed 7: {verb}: 1 rounds, ended ")
        assert line.endswith("; 0 broken promises")


def test_a_sweep_of_scans_that_was_killed_goes_on():
    played = play("--count", "2", "--verb", "sweep-scan")
    assert played.returncode == 0, played.stdout + played.stderr
    assert "sweep-scan: 2 rounds, ended " in played.stdout


def test_what_is_told_to_end_says_what_was_saved():
    played = play("--signals", "--verb", "backup", "--verb", "restore", "--count", "3")
    assert played.returncode == 0, played.stdout + played.stderr
    assert played.stdout.count("; 0 broken promises") == 2
