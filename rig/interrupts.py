"""Ctrl-C that never tears a sample apart."""

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Self

_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


class Interrupts:
    """Turns Ctrl-C, kill and a closed terminal into one KeyboardInterrupt at a good moment.

    Outside `deferred()` the interrupt is raised at once, so that a moving stage stops at once.
    Inside it waits for the end of the block, so that the sample being taken is finished and stored.
    A second signal does not wait.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._pending = False
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                self._previous[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)
        self._previous.clear()

    @contextmanager
    def deferred(self) -> Generator[None]:
        """Let an interrupt wait until this block has ended."""
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
        if self._pending and self._depth == 0:
            self._pending = False
            raise KeyboardInterrupt

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        if self._depth > 0 and not self._pending:
            self._pending = True
            return
        self._pending = False
        raise KeyboardInterrupt
