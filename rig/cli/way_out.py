"""What a signal does to the program, from its first line to its last.

While modules are read nothing can be raised: libraries turn an interrupt into errors of their own,
or lose it. Nothing is held then, so the program ends at once. Everywhere else Ctrl-C, kill and a
closed terminal become one KeyboardInterrupt, which the verb's own blocks turn into an orderly end.
"""

import logging
import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType
from typing import Any, Self

from rig.interrupts import SIGNALS, Interrupted, is_ignored, received, saved_now
from rig.terminal_text import harmless

INTERRUPTED = 130
KEPT = "what was stored before is kept"
_IMPORTS = "<frozen importlib._bootstrap>"
_AGAIN_S = 0.05


def interrupted_line(error: BaseException | None = None) -> str:
    """Return the one line that an interrupt leaves: what was saved, and how to go on."""
    while error is not None:  # what failed on the way out stands above the interrupt
        if isinstance(error, Interrupted):
            return f"rig: interrupted; {error.saved}"
        error = error.__cause__ or error.__context__
    return f"rig: interrupted; {saved_now() or KEPT}"


class WayOut:
    """The program's handlers of signals; a context manager around everything it does.

    Behind the block they stay, because the interpreter itself takes a while to end: a signal that
    comes then is none of a verb's, and must not show a traceback. Until then they do what was done
    before the block.
    """

    def __init__(self) -> None:
        self.code = 0
        """What the program ends with, once that is known."""
        self._previous: dict[int, Any] = {}
        self._hook: Any = sys.unraisablehook

    def __enter__(self) -> Self:
        received.clear()
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                if not is_ignored(number):
                    self._previous[number] = signal.signal(number, self._on_signal)
            sys.unraisablehook = self._on_unraisable
            _log_of_libraries().addFilter(_tells_no_interrupt)
        return self

    def __exit__(self, *_: object) -> None:
        for number in self._previous:
            signal.signal(number, self._behind)
        sys.unraisablehook = self._hook
        _log_of_libraries().removeFilter(_tells_no_interrupt)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        received.append(number)
        if _reads_modules(frame):
            _end_at_once(INTERRUPTED, interrupted_line())
        raise KeyboardInterrupt

    def _behind(self, number: int, frame: FrameType | None) -> None:
        if not threading.main_thread().is_alive():  # the interpreter is ending
            _end_at_once(self.code)
        previous = self._previous[number]
        if callable(previous):
            previous(number, frame)
        elif previous != signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)

    def _on_unraisable(self, what: Any) -> None:
        """Let an interrupt come again that fell into a place from where nothing is raised."""
        if not isinstance(what.exc_value, KeyboardInterrupt):
            self._hook(what)
            return
        again = threading.Timer(_AGAIN_S, os.kill, (os.getpid(), signal.SIGINT))
        again.daemon = True
        again.start()


def _log_of_libraries() -> logging.Filterer:
    """What prints on stderr what libraries log, where nobody asks for their logs."""
    return logging.lastResort or logging.NullHandler()


def _tells_no_interrupt(record: logging.LogRecord) -> bool:
    """Keep back what a library logs of an interrupt before it passes it on, as SQLAlchemy does."""
    return not (record.exc_info and isinstance(record.exc_info[1], KeyboardInterrupt))


def _reads_modules(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == _IMPORTS:
            return True
        frame = frame.f_back
    return False


def _end_at_once(code: int, line: str = "") -> None:
    if line:
        with suppress(OSError):  # the terminal may be closed, the stream in the middle of a write
            os.write(2, f"{harmless(line)}\n".encode())
    os._exit(code)
