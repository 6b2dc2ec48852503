"""A person at the live page who puts the board where it is asked for."""

import threading
import time
from collections.abc import Callable, Mapping


def _nobody() -> None:
    """Before somebody shows it, there is nothing to be shown again."""


class PageHand:
    """What is asked of the person at the page, and what the page says; a `rig.devices.Bystander`.

    One question at a time: whoever answers first has answered, of several pages and the terminal.
    """

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._asked: str | None = None
        self._questions = 0
        self._said: str | None = None
        self.on_change: Callable[[], None] = _nobody
        """Called on the thread that asks, whenever `asked` is another."""

    @property
    def asked(self) -> Mapping[str, int | str] | None:
        """What the page shows beside its button; None while nothing is asked.

        Questions are numbered: a page that missed the answer to one knows the next by it.
        """
        with self._news:
            if self._asked is None:
                return None
            return {"number": self._questions, "text": self._asked}

    def ask(self, text: str) -> None:
        """Show a question; what was said before does not answer it."""
        with self._news:
            self._asked, self._said = text, None
            self._questions += 1
        self.on_change()

    def settle(self) -> None:
        """Take the question back: it is answered, or nobody waits any more."""
        with self._news:
            self._asked = self._said = None
        self.on_change()

    def answer(self, timeout_s: float) -> str | None:
        """Return what the page said since; None where it said nothing in time."""
        until_s = time.monotonic() + timeout_s
        with self._news:
            while self._said is None:
                left_s = until_s - time.monotonic()
                if left_s <= 0.0:
                    return None
                self._news.wait(left_s)
            said, self._said = self._said, None
            return said

    def say(self, reading: str) -> str:
        """Take an answer of a page, in the page's thread; return one line about it."""
        with self._news:
            if self._asked is None or self._said is not None:
                return "nobody asks for the board now"
            self._said = reading
            self._news.notify_all()
        return f"the board stands at {reading} mm" if reading else "the board stands there"
