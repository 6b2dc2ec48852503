"""Frame numbers without an end, from the counter of a camera."""

from typing import Final

_SHORT: Final = 65535
"""Where the counter of GigE Vision 1 begins anew, with 1."""
_NEAR_END: Final = _SHORT - _SHORT // 8


class FrameNumbers:
    """Counts on over the end of a short counter, and counts what it jumped over."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._sequence = -1
        self.lost = 0
        """Numbers that never came."""

    def next(self, frame_id: int) -> int | None:
        """Return the number of a frame, from 0; None for one that came before.

        Args:
            frame_id: as the camera counts.
        """
        if self._last is None:
            step = 1
        elif frame_id > self._last:
            step = frame_id - self._last
        elif _NEAR_END < self._last <= _SHORT and frame_id < _SHORT // 8:
            step = frame_id - self._last + (_SHORT if frame_id else _SHORT + 1)
        else:
            return None
        self._last = frame_id
        self._sequence += step
        self.lost += step - 1
        return self._sequence
