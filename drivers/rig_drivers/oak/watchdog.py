"""Which sensors are silent: DepthAI's Sync waits for ever for one that died."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The newest frame of one sensor."""

    start_s: float
    """When its exposure began."""
    middle_s: float


class Watchdog:
    """Remembers the newest frame of every sensor, paired or not."""

    def __init__(self, views: Iterable[str]) -> None:
        self._newest: dict[str, Heartbeat | None] = dict.fromkeys(views)

    def saw(self, view: str, *, start_s: float, middle_s: float) -> None:
        """Note a frame; an older one than before changes nothing."""
        before = self._newest[view]
        if before is None or middle_s > before.middle_s:
            self._newest[view] = Heartbeat(start_s, middle_s)

    def silent_since(self, since_s: float) -> tuple[str, ...]:
        """Return the sensors of which no frame was begun at or after `since_s`."""
        return tuple(
            view for view, beat in self._newest.items() if beat is None or beat.start_s < since_s
        )

    def phase_s(self, period_s: float) -> float:
        """Return how far sensors of one rate are out of step; 0 before all have sent.

        The newest frames may be of neighbouring periods, so that times count modulo the period.
        """
        times_s = [beat.middle_s for beat in self._newest.values() if beat is not None]
        if len(times_s) < len(self._newest) or not times_s:
            return 0.0
        half_s = period_s / 2.0
        offsets_s = [(t_s - times_s[0] + half_s) % period_s - half_s for t_s in times_s]
        return max(offsets_s) - min(offsets_s)
