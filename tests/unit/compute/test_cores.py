import os
from pathlib import Path

import pytest

from rig.compute.cores import cores, threads
from rig.errors import ConfigError

ALLOWED = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def machine(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


def held_to(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: set(range(count)), raising=False)


@pytest.mark.parametrize("asked", ["1", "2", "3", "256"])
def test_the_variable_says_how_many_threads(asked: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_THREADS", asked)
    assert threads() == int(asked)


@pytest.mark.parametrize("asked", ["0", "-1", "257", "two", "1.5", " 2", "²", "9" * 30])
def test_what_is_no_number_of_threads_is_told(asked: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_THREADS", asked)
    with pytest.raises(ConfigError, match="RIG_THREADS asks for") as refused:
        threads()
    assert repr(asked) in refused.value.found
    assert "from 1 to 256" in refused.value.advice


@pytest.mark.parametrize("asked", [None, ""])
def test_without_it_there_is_one_for_every_core(
    asked: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RIG_THREADS", raising=False)
    if asked is not None:
        monkeypatch.setenv("RIG_THREADS", asked)
    assert threads() == cores(Path("/"))
    assert 1 <= threads() <= (ALLOWED or 1)


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({}, 6),
        ({"sys/fs/cgroup/cpu.max": "max 100000\n"}, 6),
        ({"sys/fs/cgroup/cpu.max": "200000 100000\n"}, 2),
        ({"sys/fs/cgroup/cpu.max": "150000 100000\n"}, 2),
        ({"sys/fs/cgroup/cpu.max": "50000 100000\n"}, 1),
        ({"sys/fs/cgroup/cpu.max": "900000 100000\n"}, 6),
        ({"sys/fs/cgroup/cpu.max": "nonsense"}, 6),
        ({"sys/fs/cgroup/cpu.max": "0 0"}, 6),
        (
            {
                "proc/self/cgroup": "0::/house/room\n",
                "sys/fs/cgroup/house/cpu.max": "300000 100000",
                "sys/fs/cgroup/house/room/cpu.max": "400000 100000",
            },
            3,
        ),
        ({"sys/fs/cgroup/cpu/cpu.cfs_quota_us": "-1\n"}, 6),
        (
            {
                "proc/self/cgroup": "9:name=systemd:/\n4:cpu,cpuacct:/room\n",
                "sys/fs/cgroup/cpu/room/cpu.cfs_quota_us": "200000\n",
                "sys/fs/cgroup/cpu/room/cpu.cfs_period_us": "50000\n",
            },
            4,
        ),
    ],
)
def test_a_quota_holds_threads_down(
    files: dict[str, str], expected: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held_to(monkeypatch, 6)
    assert cores(machine(tmp_path, files)) == expected


def test_cores_that_the_process_is_kept_from_do_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held_to(monkeypatch, 3)
    assert cores(tmp_path) == 3
