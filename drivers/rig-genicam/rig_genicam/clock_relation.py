"""When a frame came, by the even clock of its camera and the uneven one of its arrival."""

from collections import deque
from typing import Final

_KEPT: Final = 64
"""Frames that tell the offset: two clocks that drift apart by 100 ppm are 0.2 ms apart after 64
frames at 30 Hz, less than a frame's way takes."""


class ClockRelation:
    """Where the clock of a camera stands on that of the host.

    What a timestamp of a camera marks (start, end of the exposure, or begin of the read-out) its
    maker decides, so only its evenness is used: the quickest of the last frames tells the offset.
    The answer is when the first bytes would have come had nothing delayed them, and never later
    than they came.
    """

    def __init__(self) -> None:
        self._offsets_s: deque[float] = deque(maxlen=_KEPT)
        self._last_device_s: float | None = None

    def arrival_s(self, device_s: float, arrived_s: float) -> float:
        """Return when a frame came, on the clock of the host.

        Args:
            device_s: time of the frame by the camera's clock, of any zero; one that steps back
                begins anew.
            arrived_s: when its first bytes came, on the clock of the host.
        """
        if self._last_device_s is not None and device_s <= self._last_device_s:
            self._offsets_s.clear()
        self._last_device_s = device_s
        self._offsets_s.append(arrived_s - device_s)
        return device_s + min(self._offsets_s)
