"""Progress with time left: one live line on a terminal, plain lines elsewhere."""

import sys
import time
from types import TracebackType
from typing import Self

from rig.cli.output import tell, tell_raw

_LINE_EVERY_S = 2.0


class Progress:
    """Says how far a run is; on a terminal it keeps rewriting one line."""

    def __init__(self, total: int | None) -> None:
        self._total = total
        self._first: tuple[int, float] | None = None
        self._last_s = 0.0
        self._is_terminal = sys.stderr.isatty()
        self._width = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._is_terminal and self._width:
            tell_raw("\n")

    def report(self, done: int, text: str) -> None:
        """Show that `done` of the total are done.

        Time left is counted from the first call on: what came before it, such as homing or the
        compilation of kernels, does not repeat itself.
        """
        now_s = time.monotonic()
        if self._first is None:
            self._first = (done, now_s)
        is_last = self._total is not None and done >= self._total
        if not self._is_terminal and not is_last and now_s - self._last_s < _LINE_EVERY_S:
            return
        self._last_s = now_s
        count = f"{done}" if self._total is None else f"{done}/{self._total}"
        left = self._left(done, *self._first, now_s)
        line = f"[{count}] {text}{left}"
        if self._is_terminal:
            tell_raw("\r" + line.ljust(self._width))
            self._width = len(line)
        else:
            tell(line)

    def _left(self, done: int, first: int, first_s: float, now_s: float) -> str:
        if self._total is None or done <= first or done >= self._total:
            return ""
        left_s = (now_s - first_s) / (done - first) * (self._total - done)
        return f", {left_s // 60:.0f} min {left_s % 60:.0f} s left"
