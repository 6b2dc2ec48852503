"""How a duration went over any number of frames, in memory that does not grow."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

EXACT: Final = 1000
"""As many values are kept as they are."""
_SHORTEST_S: Final = 1e-6
_LONGEST_S: Final = 1e6
_STEP: Final = 0.01
"""Width of a class of durations, as a part of it."""
_CLASSES: Final = math.ceil(math.log(_LONGEST_S / _SHORTEST_S) / math.log1p(_STEP)) + 1


@dataclass(frozen=True, slots=True)
class Spread:
    """How a duration went over the multi-views of a capture; NaN where there were none.

    Up to `EXACT` of them median and percentile are exact; of more they are right within half a
    per cent, or a microsecond.
    """

    median: float
    p95: float
    """95th percentile."""
    largest: float
    """Exact."""


class SpreadTally:
    """Counts durations: the first ones as they are, all of them in classes 1 % apart."""

    def __init__(self) -> None:
        self._first: list[float] = []
        self._counts = np.zeros(_CLASSES, np.int64)
        self._largest = -math.inf

    def add(self, duration_s: float) -> None:
        """Count one."""
        if len(self._first) <= EXACT:
            self._first.append(duration_s)
        self._largest = max(self._largest, duration_s)
        self._counts[_class_of(duration_s)] += 1

    @property
    def spread(self) -> Spread:
        """Of all so far."""
        if not self._first:
            return Spread(math.nan, math.nan, math.nan)
        if len(self._first) <= EXACT:
            median, p95 = (float(np.percentile(self._first, percent)) for percent in (50, 95))
        else:
            median, p95 = (self._percentile(percent) for percent in (50, 95))
        return Spread(median, p95, self._largest)

    def _percentile(self, percent: int) -> float:
        """The least duration that so many per cent do not exceed, to its class."""
        summed = np.cumsum(self._counts)
        number = int(np.searchsorted(summed, percent / 100.0 * summed[-1]))
        if number == 0:
            return 0.0
        return min(self._largest, _SHORTEST_S * (1.0 + _STEP) ** (number - 0.5))


def _class_of(duration_s: float) -> int:
    """Class 0 is at most the shortest; class n ends n steps above it."""
    if duration_s <= _SHORTEST_S:
        return 0
    steps = math.log(duration_s / _SHORTEST_S) / math.log1p(_STEP)
    return min(math.ceil(steps), _CLASSES - 1)
