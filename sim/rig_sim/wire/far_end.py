"""The far end of a wire is another machine: Ctrl-C at this one does not reach it."""

import signal
import threading
from types import FrameType
from typing import Any, Self

_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


class FarEnd:
    """While a firmware runs in this block signals wait; they are heard at its end, in order."""

    def __init__(self) -> None:
        self._heard: list[tuple[int, FrameType | None]] = []
        self._handlers: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                if callable(signal.getsignal(number)):
                    self._handlers[number] = signal.signal(number, self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        for number, frame in self._heard:
            self._handlers[number](number, frame)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        self._heard.append((number, frame))
