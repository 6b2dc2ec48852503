"""Which frames of a stream were read too late: the newest counts, those that waited do not."""

from collections.abc import Callable, Iterator

from rig.devices import Clock
from rig.frames import Frame


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


def newest_frames(
    take: Callable[[float], Frame | None],
    clock: Clock,
    rule: LatenessRule,
    *,
    timeout_s: float,
    count_late: Callable[[], None],
) -> Iterator[Frame]:
    """Yield the frames of one device that are exposed from now on, none that waited too long.

    Each must come within `timeout_s` of being asked for. What is passed over on the way, because it
    is old, late or damaged, gives no further time.

    Args:
        take: returns the next frame before a deadline on `clock`, s; None for one that turns out to
            be damaged. Raises CaptureTimeoutError at the deadline.
        clock: of the frames and of the deadlines.
        rule: of this stream.
        timeout_s: longest wait for one frame.
        count_late: called for every frame that came too late.
    """
    called_s = asked_s = clock.now_s()
    while True:
        frame = take(asked_s + timeout_s)
        if frame is None or frame.timestamp_s < called_s:
            continue
        if rule.passes_over(clock.now_s() - frame.timestamp_s):
            count_late()
            continue
        yield frame
        asked_s = clock.now_s()
