"""The stage's program, started once for each thing that is asked of it: the door to processes."""

import os
import signal
import subprocess
from collections.abc import Sequence
from contextlib import suppress
from typing import Protocol

from rig.errors import DeviceNotFoundError

KILL_S = 2.0
"""A killed process is gone within this time."""


class Running(Protocol):
    """One call of the program, at work."""

    def output(self, wait_s: float) -> tuple[int, str, str] | None:
        """Return exit code, output and complaints; None: still at work after `wait_s`."""
        ...

    def kill(self) -> None:
        """End it."""
        ...


class Program(Protocol):
    """Starts calls."""

    def start(self, arguments: Sequence[str]) -> Running:
        """Start one call.

        Raises:
            DeviceNotFoundError: there is no such program, or it may not be run.
        """
        ...


class CommandProgram:
    """A program of this machine; its argument list is passed as it is."""

    def __init__(self, command: Sequence[str], device: str) -> None:
        self._command = tuple(command)
        self._device = device

    def start(self, arguments: Sequence[str]) -> Running:
        """See `Program.start`."""
        try:
            process = subprocess.Popen(  # noqa: S603
                [*self._command, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                start_new_session=True,  # Ctrl-C reaches rig alone, which then asks it to stop
            )
        except (OSError, ValueError) as error:
            raise DeviceNotFoundError(
                self._device,
                f"cannot run {self._command[0]!r}: {error}",
                advice="check stage.command: the program's path first, then its arguments",
            ) from error
        return _Process(process)


class _Process:
    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def output(self, wait_s: float) -> tuple[int, str, str] | None:
        try:
            said, complained = self._process.communicate(timeout=wait_s)
        except subprocess.TimeoutExpired:
            return None
        return self._process.returncode, said, complained

    def kill(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)  # and whatever it has started itself
        self.output(KILL_S)
