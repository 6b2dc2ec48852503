"""Ctrl-C that never tears a sample apart, and says what was saved."""

import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Self

SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Ctrl-C, kill, and a terminal that was closed."""

received: list[int] = []
"""Every signal that came since the program began: signals are the process's, and so is this."""

_sayings: list[Callable[[], str]] = []


class Interrupted(KeyboardInterrupt):
    """An interrupt that knows what it left behind.

    Args:
        saved: what was saved and how to go on; one line, to follow "interrupted; ".
    """

    def __init__(self, saved: str) -> None:
        super().__init__(saved)
        self.saved = saved


@contextmanager
def saying(saved: Callable[[], str]) -> Generator[None]:
    """Let an interrupt of this block say what was saved, unless an inner block said it already.

    Args:
        saved: asked when the interrupt has come; looks nothing up.

    Raises:
        Interrupted: instead of a bare KeyboardInterrupt.
    """
    _sayings.append(saved)
    try:
        yield
    except Interrupted:
        raise
    except KeyboardInterrupt as error:
        raise Interrupted(saved()) from error
    finally:
        _sayings.pop()


def saved_now() -> str | None:
    """Return what the innermost `saying` block would say; None outside of any."""
    return _sayings[-1]() if _sayings else None


def is_ignored(number: int) -> bool:
    """Tell whether a signal is to be left alone: nohup(1) hands a hangup down ignored."""
    hangup = getattr(signal, "SIGHUP", None)
    return number == hangup and signal.getsignal(number) is signal.SIG_IGN


class Interrupts:
    """Turns Ctrl-C, kill and a closed terminal into one KeyboardInterrupt at a good moment.

    Outside `deferred()` the interrupt is raised at once, so that a moving stage stops at once.
    Inside it waits for the end of the block, so that the sample being taken is finished and stored.
    A second signal does not wait. Inside `shielded()` all wait: what ends a motion must not be torn
    apart by somebody who presses twice.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._shields = 0
        self._pending = False
        self.came = False
        """Whether a signal came, whatever a library has made of it."""
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                if not is_ignored(number):
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
        self._raise_pending()

    @contextmanager
    def shielded(self) -> Generator[None]:
        """Let every interrupt wait until this block has ended; one that ends by itself soon."""
        self._shields += 1
        try:
            yield
        finally:
            self._shields -= 1
        self._raise_pending()

    def _raise_pending(self) -> None:
        if self._pending and self._depth == 0 and self._shields == 0:
            self._pending = False
            raise KeyboardInterrupt

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        received.append(number)
        self.came = True
        if self._shields > 0 or (self._depth > 0 and not self._pending):
            self._pending = True
            return
        self._pending = False
        raise KeyboardInterrupt
