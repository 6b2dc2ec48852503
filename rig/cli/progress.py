"""Progress with time left: one live line on a terminal, plain lines elsewhere."""

import math
import sys
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Self

from rig.cli.output import tell, tell_raw

_LINE_EVERY_S = 2.0
_MARKS = 512


class _Mark(NamedTuple):
    done: int
    at_s: float


class ProgressLine:
    """Says how far a run is; on a terminal it keeps rewriting one line."""

    def __init__(self, total: int | None, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._total = total
        self._clock_s = clock_s
        self._marks: deque[_Mark] = deque(maxlen=_MARKS)
        self._last_s = -math.inf
        self._is_terminal = sys.stderr.isatty()
        self._width = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_terminal and self._width:
            tell_raw("\n")

    def report(self, done: int, text: str) -> None:
        """Show that `done` of the total are done.

        Time left goes by the pace of the later half of what is done: what happened before, such as
        homing and the compilation of kernels, does not repeat itself.
        """
        now_s = self._clock_s()
        self._marks.append(_Mark(done, now_s))
        is_last = self._total is not None and done >= self._total
        if not self._is_terminal and not is_last and now_s - self._last_s < _LINE_EVERY_S:
            return
        self._last_s = now_s
        count = f"{done}" if self._total is None else f"{done}/{self._total}"
        line = f"[{count}] {text}{self._left()}"
        if self._is_terminal:
            tell_raw("\r" + line.ljust(self._width))
            self._width = len(line)
        else:
            tell(line)

    def tell(self, text: str) -> None:
        """Say something else on a line of its own; on a terminal the live line makes room."""
        if self._is_terminal and self._width:
            tell_raw("\r" + " " * self._width + "\r")
        tell(text)

    def _left(self) -> str:
        since, now = self._marks[len(self._marks) // 2], self._marks[-1]
        if self._total is None or not since.done < now.done < self._total:
            return ""
        left_s = (now.at_s - since.at_s) / (now.done - since.done) * (self._total - now.done)
        return f", {left_s // 60:.0f} min {left_s % 60:.0f} s left"
