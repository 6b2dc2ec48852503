"""How many threads share the work: the cores that this process may use, or what RIG_THREADS says.

A process may be held to some cores (`taskset`, cpusets) and to a share of their time (the quota of
a control group, `docker run --cpus`). Threads beyond either only wait for each other.
"""

import math
import os
from functools import cache
from pathlib import Path

from rig.errors import ConfigError

VARIABLE = "RIG_THREADS"
_ROOT = Path("/")
"""Kept, since a path that is made anew for each band of work costs more than the answer."""
_MOST = 256
"""More than this is a slip of the keyboard, and would only cost memory."""


def threads() -> int:
    """Return how many threads share the work.

    Raises:
        ConfigError: the variable `RIG_THREADS` holds something else than a number of threads.
    """
    asked = os.environ.get(VARIABLE, "")
    return _told(asked) if asked else cores(_ROOT)


@cache
def _told(asked: str) -> int:
    if asked.isascii() and asked.isdigit() and 1 <= int(asked) <= _MOST:
        return int(asked)
    raise ConfigError(
        f"the variable {VARIABLE} asks for {asked!r} threads",
        advice=f"give a whole number from 1 to {_MOST}, or unset it: rig then takes the "
        f"{cores(_ROOT)} that this process may use",
    )


@cache
def cores(root: Path) -> int:
    """Return how many cores this process may use, at least 1.

    Args:
        root: where the folders `proc` and `sys` lie.
    """
    if hasattr(os, "sched_getaffinity"):
        allowed = len(os.sched_getaffinity(0))
    else:
        allowed = os.cpu_count() or 1
    return max(min(allowed, _quota(root)), 1)


def _quota(root: Path) -> int:
    """Cores whose time the control groups of this process grant, begun ones counted."""
    granted = [quota for folder in _groups(root) if (quota := _granted(folder)) is not None]
    return math.ceil(min(granted, default=math.inf)) if granted else _MOST


def _groups(root: Path) -> list[Path]:
    """Folders of the control groups that bind this process, its own and those around it."""
    top = root / "sys/fs/cgroup"
    folders = [top, top / "cpu"]
    for line in _text(root / "proc/self/cgroup").splitlines():
        _, names, path = [*line.split(":", 2), "", ""][:3]
        if names == "" or "cpu" in names.split(","):
            own = (top if names == "" else top / "cpu") / path.lstrip("/")
            folders += [own, *(around for around in own.parents if around.is_relative_to(top))]
    return folders


def _granted(folder: Path) -> float | None:
    """Share of a core's time times cores that one group grants; None where it sets no limit."""
    words = _text(folder / "cpu.max").split()
    if not words:
        words = [_text(folder / f"cpu.cfs_{name}_us").strip() for name in ("quota", "period")]
    if len(words) != 2 or not all(word.isascii() and word.isdigit() for word in words):
        return None  # "max", -1, or no such group
    quota, period = (int(word) for word in words)
    return quota / period if quota and period else None


def _text(path: Path) -> str:
    """What a file says; nothing where it cannot be read."""
    try:
        return path.read_text("utf-8", errors="replace")
    except OSError:
        return ""
