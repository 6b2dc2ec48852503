"""Which frames of a stream were read too late: the newest counts, those that waited do not."""


class LatenessRule:
    """Passes over frames that waited in a device's buffers, never more than it has.

    A frame is late where it is older than two periods. Were all of them that old, because the
    device itself is slow, passing over each would give none at all: after as many as can wait, the
    next one is the newest there is.

    Args:
        period_s: time between two frames.
        waiting: as many frames wait at most.
    """

    def __init__(self, period_s: float, waiting: int) -> None:
        self._oldest_s = 2.0 * period_s
        self._waiting = waiting
        self._passed_over = 0

    def passes_over(self, age_s: float) -> bool:
        """Say whether a frame is to be left out.

        Args:
            age_s: time since it was exposed.
        """
        is_late = age_s > self._oldest_s and self._passed_over < self._waiting
        self._passed_over = self._passed_over + 1 if is_late else 0
        return is_late
