"""One page: what it wants, what it has been sent, and what it has drawn."""

import time
from asyncio import Event
from collections import deque
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from rig.view.message import Message

IN_FLIGHT = 2
"""Messages that are sent and not yet drawn: one on the way, one being drawn."""
_STALLED_S = 10.0
_ALL = frozenset({"views", "sigma", "label"})

M = TypeVar("M", bound=Message)


@dataclass(slots=True)
class Sent(Generic[M]):
    """A message on its way."""

    number: int
    message: M
    published_s: float


@dataclass(slots=True)
class Client(Generic[M]):
    """State of one page; used by the thread of the server only."""

    peer: str
    wants: frozenset[str] = _ALL
    is_frozen: bool = False
    news: Event = field(default_factory=Event)
    last: int = -1
    """Number of the newest message that it was sent."""
    shown: Sent[M] | None = None
    """What it drew last."""
    skipped: int = 0
    """Messages that it was not sent: newer ones came before it had drawn."""
    _in_flight: deque[Sent[M]] = field(default_factory=deque[Sent[M]])
    _ages_s: deque[float] = field(default_factory=lambda: deque[float](maxlen=64))

    @property
    def has_credit(self) -> bool:
        """Whether it may be sent something."""
        return not self.is_frozen and len(self._in_flight) < IN_FLIGHT

    def sends(self, sent: Sent[M]) -> None:
        """Count a message as on its way."""
        if self.last >= 0:
            self.skipped += sent.number - self.last - 1
        self.last = sent.number
        self._in_flight.append(sent)

    def asks_for(self, wants: frozenset[str]) -> None:
        """Take what it wants from now on; the newest message comes again with what is new."""
        if wants - self.wants and self.last >= 0:
            self.last -= 1
        self.wants = wants

    def acknowledged(self, number: int, now_s: float) -> bool:
        """Take the word of the page that it has drawn a message; False if it had no such one."""
        if all(sent.number != number for sent in self._in_flight):
            return False
        while self._in_flight:
            self.shown = self._in_flight.popleft()
            if self.shown.number == number:
                self._ages_s.append(now_s - self.shown.published_s)
                break
        return True

    def is_stalled(self, now_s: float | None = None) -> bool:
        """Whether it draws nothing any more, though it says not that it is frozen."""
        if self.is_frozen or not self._in_flight:
            return False
        now_s = time.monotonic() if now_s is None else now_s
        return now_s - self._in_flight[0].published_s > _STALLED_S

    def age_s(self) -> float | None:
        """Median time from handing a message over until the page said that it is drawn."""
        ages_s = sorted(self._ages_s)
        return ages_s[len(ages_s) // 2] if ages_s else None
