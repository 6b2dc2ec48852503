"""How much of what the sensors send arrives: a link that is too slow loses pictures in silence."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass

from rig_drivers.oak.bandwidth import ETHERNET

_log = logging.getLogger(__name__)

_FRAMES: int = 30
"""So many frames of a sensor are judged together: two that are lost by chance are no slow link."""
_MOST_LOST_SHARE = 0.2
"""A link that is too slow loses more; a busy computer or a single fault less."""
_FAST_ETHERNET_MB_S = 12.5
"""100 Mbit/s: what an old switch or a cable with two of four pairs leaves of gigabit Ethernet."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Counters of one group of frames."""

    group: int
    """Number of the group: one more for each that arrived whole."""
    frames: Mapping[str, int]
    """By view: number of its frame, counted by its sensor."""


class Arrivals:
    """Compares what arrived whole with what the sensors took; says so once where much is lost.

    Args:
        device: name in messages.
        link: see `link_of`.
        needed_mb_s: what the sensors send.
        rate_hz: multi-views per second.
    """

    def __init__(self, device: str, *, link: str, needed_mb_s: float, rate_hz: float) -> None:
        self._device = device
        self._link = link
        self._needed_mb_s = needed_mb_s
        self._rate_hz = rate_hz
        self._first: Seen | None = None
        self.problem: str | None = None
        """What is wrong with the link and what to do; None while nothing is known to be."""

    def saw(self, seen: Seen) -> None:
        """Take the counters of a group in, groups in their order; between them any may be skipped.

        What nobody took out is counted as arrived: it has a number of its own.
        """
        first = self._first
        if first is None:
            self._first = seen
            return
        taken = max(number - first.frames[view] for view, number in seen.frames.items())
        if taken < _FRAMES:
            return
        self._first = seen
        arrived = min(seen.group - first.group, taken)
        if arrived < (1.0 - _MOST_LOST_SHARE) * taken:
            self._tell(arrived, taken)

    def _tell(self, arrived: int, taken: int) -> None:
        if self.problem is not None:
            return
        share = arrived / taken
        arrived_mb_s = share * self._needed_mb_s
        fits_hz = share * self._rate_hz
        is_slow = self._link == ETHERNET and arrived_mb_s <= _FAST_ETHERNET_MB_S
        cause = (
            "as over Ethernet of 100 Mbit/s; use a gigabit switch and a cable with all four pairs"
            if is_slow
            else "look for a busy link or a bad cable"
        )
        self.problem = (
            f"{self._device}: {arrived} of {taken} multi-views arrive whole over {self._link}, "
            f"{arrived_mb_s:.1f} of {self._needed_mb_s:.1f} MB/s, {cause}, or lower "
            f"camera.rate_hz to {fits_hz:.1f}"
        )
        _log.warning("%s", self.problem)
