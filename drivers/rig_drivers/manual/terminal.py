"""A person at the terminal: told where the board belongs, heard when it stands there."""

import os
import select
import sys
from typing import Protocol

from rig.errors import DeviceLostError, DeviceNotFoundError

LONGEST_ANSWER = 100
"""Characters; more is a file and no person."""


class Person(Protocol):
    """Who puts the board somewhere, and says so."""

    def greet(self) -> None:
        """See that somebody is there.

        Raises:
            DeviceNotFoundError: nobody can be.
        """
        ...

    def tell(self, text: str) -> None:
        """Show one line."""
        ...

    def answer(self, timeout_s: float) -> str | None:
        """Return what was typed before Enter; None if nobody has pressed it in time.

        Raises:
            DeviceLostError: nobody can answer any more.
        """
        ...


class Terminal:
    """Asks on standard error, hears on standard input."""

    def __init__(self, device: str) -> None:
        self._device = device
        self._typed = b""

    def greet(self) -> None:
        """See `Person.greet`."""
        self._typed = b""
        if not sys.stdin.isatty():
            raise DeviceNotFoundError(
                self._device,
                'asks a person at the terminal (kind = "manual"), standard input is none',
                advice="run it in a terminal, or with --view and press the button of the page, or "
                "take another kind of stage: see docs/how-to/manual-stage.md",
            )

    def tell(self, text: str) -> None:
        """See `Person.tell`."""
        # Progress stands on an unfinished line.
        sys.stderr.write(f"\n{text}\n")
        sys.stderr.flush()

    def answer(self, timeout_s: float) -> str | None:
        """See `Person.answer`."""
        ready, _, _ = select.select([sys.stdin], [], [], max(0.0, timeout_s))
        if not ready:
            return None
        try:
            # Not `readline`: it would wait for the end of a line that was only begun.
            came = os.read(sys.stdin.fileno(), LONGEST_ANSWER)
        except OSError as error:
            raise self._gone() from error
        if not came:
            raise self._gone()
        self._typed = (self._typed + came)[-LONGEST_ANSWER:]
        line, end, rest = self._typed.partition(b"\n")
        if not end:
            return None
        self._typed = rest
        return line.decode("ascii", errors="replace").strip()

    def _gone(self) -> DeviceLostError:
        return DeviceLostError(
            self._device,
            "the terminal is closed, nobody can say where the board stands",
            advice="resume the run in a terminal",
        )
