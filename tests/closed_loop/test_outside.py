"""Hundredths of the campaigns against what comes from outside: changed inputs, failing disks."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.disk_faults import KINDS
from benchmarks.fuzz.sources import SOURCES

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]


def test_inputs_that_are_changed_at_random_are_read_or_refused(tmp_path: Path):
    record = tmp_path / "fuzz.jsonl"
    words = ("--count", "100", "--seed", "7", "--record", str(record))
    command = [sys.executable, "-m", "benchmarks.fuzz", *words]
    done = _run(command)
    assert done.returncode == 0, done.stdout + done.stderr
    batches = [json.loads(line) for line in record.read_text().splitlines()]
    assert {batch["source"] for batch in batches} == {source.name for source in SOURCES}
    for batch in batches:
        assert batch["read"] + batch["refused"] == batch["count"]
        assert batch["refused"] > 0
    assert sum(batch["read"] for batch in batches) > 100  # some of both, or nothing is tried
    again = _run(command)
    assert again.stdout == done.stdout  # a second call goes on where the first one ended
    assert len(record.read_text().splitlines()) == len(batches)


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, check=False, cwd=ROOT, capture_output=True, text=True, timeout=280
    )


def test_a_disk_that_fails_below_the_file_system_loses_no_sample(tmp_path: Path):
    if sys.platform != "linux":
        pytest.skip("calls are caught by LD_PRELOAD, which needs Linux")
    record = tmp_path / "disk.jsonl"
    words = ("--seed", "7", "--count", "5", "--record", str(record))
    done = _run([sys.executable, "-m", "benchmarks.disk_faults", *words])
    assert done.returncode == 0, done.stdout + done.stderr
    rounds = [json.loads(line) for line in record.read_text().splitlines()]
    assert [played["broken"] for played in rounds] == [[]] * 5
    assert {played["kind"] for played in rounds} <= set(KINDS)
