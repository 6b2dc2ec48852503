"""The rate of a device that tells none, from its frames: what the profile says must be so."""

from typing import Final

from rig.errors import ConfigError

_FRAMES: Final = 5
"""So many intervals are looked at."""
_TOLERANCE: Final = 0.1
"""Largest relative difference between the rate of the profile and that of the frames."""


class RateWatch:
    """Compares the rate that the profile names with the first frames of a stream.

    When a frame was exposed is reckoned with the rate; a wrong one would let stale frames through.

    Args:
        camera: named in the error.
        rate_hz: of the profile.
        advice: what to do where frames come at another rate.
    """

    def __init__(self, camera: str, rate_hz: float, *, advice: str) -> None:
        self._camera = camera
        self._advice = advice
        self._rate_hz = rate_hz
        self._first: tuple[int, float] | None = None
        self._is_settled = False

    def see(self, sequence: int, timestamp_s: float) -> None:
        """Look at one frame.

        Args:
            sequence: its number, lost frames counted.
            timestamp_s: its time.

        Raises:
            ConfigError: frames come at another rate.
        """
        if self._is_settled:
            return
        if self._first is None:
            self._first = sequence, timestamp_s
            return
        intervals = sequence - self._first[0]
        if intervals < _FRAMES:
            return
        found_hz = intervals / (timestamp_s - self._first[1])
        if abs(found_hz / self._rate_hz - 1.0) > _TOLERANCE:
            raise ConfigError(
                f"{self._camera}: asked for {self._rate_hz:.4g} Hz, frames come at "
                f"{found_hz:.4g} Hz, and the device takes no rate",
                advice=self._advice,
            )
        self._is_settled = True
