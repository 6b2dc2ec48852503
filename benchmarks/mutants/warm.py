"""A process that has imported what every test needs, and runs tests in forks of itself.

Imports take most of the time of a trial; none of them is of a file in which faults are made.
"""

import importlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

_NEEDED = (
    "pytest",
    "hypothesis",
    "numpy",
    "scipy.optimize",
    "scipy.stats",
    "cv2",
    "numba",
    "pydantic",
    "typer",
    "typer.testing",
    "sqlalchemy.orm",
    "alembic.command",
    "serial",
    "jinja2",
)
_OPTIONS = (
    *("-q", "-x", "-p", "no:cacheprovider", "--no-header"),
    # That plug-ins were imported before pytest could rewrite them is the very idea here.
    *("-W", "ignore::pytest.PytestAssertRewriteWarning"),
)
_POLL_S = 0.02
_HANGS = -1
"""Stands for the exit code of tests that did not end in time."""


class Warm:
    """The process as seen by who asks it to run tests in `folder`."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.mutants.warm"],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, names: Path, limit_s: float) -> int | None:
        """Run the tests that a file lists, until the first fails.

        Returns:
            pytest's exit code; None if they did not end in time.
        """
        assert self._process.stdin is not None  # noqa: S101 - both are pipes
        assert self._process.stdout is not None  # noqa: S101
        self._process.stdin.write(json.dumps({"names": str(names), "limit_s": limit_s}) + "\n")
        self._process.stdin.flush()
        code = int(self._process.stdout.readline())
        return None if code == _HANGS else code

    def close(self) -> None:
        """End the process."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.wait()


def _ended(child: int, limit_s: float) -> int:
    """Wait for a fork; one that takes too long is killed, with all that it started."""
    until_s = time.monotonic() + limit_s
    while time.monotonic() < until_s:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) if os.WIFEXITED(status) else 1
        time.sleep(_POLL_S)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return _HANGS


def _run_tests(names: str) -> int:
    import pytest  # noqa: PLC0415 - loaded already in this process, and in no other

    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    return int(pytest.main([*_OPTIONS, f"@{names}"]))


def main() -> None:
    """Serve until the input ends."""
    for module in _NEEDED:
        importlib.import_module(module)
    for line in sys.stdin:
        asked: dict[str, Any] = json.loads(line)
        child = os.fork()
        if not child:
            os.setpgid(0, 0)
            code = 1
            try:
                code = _run_tests(asked["names"])
            finally:
                os._exit(code)
        sys.stdout.write(f"{_ended(child, asked['limit_s'])}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
