"""Which frames of several free-running cameras belong to one instant; knows no clock."""

import statistics
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, Generic, TypeVar

Item = TypeVar("Item")

_KEPT: Final = 16
"""Frames of one camera that wait for a partner at most."""
_INTERVALS: Final = 9
"""So many last intervals tell how fast a camera really is."""
_CLEARLY: Final = 1.25
"""Ratio of periods from which they are different; below it may be jitter."""


@dataclass(frozen=True, slots=True)
class Drop(Generic[Item]):
    """A frame that is in no multi-view, and why.

    Reasons: `lead-in` from before all cameras ran; `unpaired` no frame of another camera near
    enough, or one too many of a faster camera; `skew` partners found, but too far apart; `order`
    not later than the camera's frame before.
    """

    camera: int
    item: Item
    reason: str


@dataclass(slots=True)
class Outcome(Generic[Item]):
    """What one new frame decided."""

    groups: list[tuple[Item, ...]] = field(default_factory=list["tuple[Item, ...]"])
    """One item per camera, in the cameras' order, of one instant each."""
    drops: list[Drop[Item]] = field(default_factory=list["Drop[Item]"])


@dataclass(slots=True)
class _Queue(Generic[Item]):
    """Frames of one camera that are not decided yet, oldest first."""

    period_s: float
    frames: deque[tuple[float, Item]] = field(default_factory=deque["tuple[float, Item]"])
    intervals_s: deque[float] = field(default_factory=lambda: deque[float](maxlen=_INTERVALS))
    last_s: float | None = None

    def push(self, time_s: float, item: Item) -> None:
        if self.last_s is not None:
            self.intervals_s.append(time_s - self.last_s)
            if len(self.intervals_s) == _INTERVALS:
                self.period_s = statistics.median(self.intervals_s)
        self.last_s = time_s
        self.frames.append((time_s, item))

    def nearest(self, time_s: float) -> int | None:
        """Return the index of the frame nearest to `time_s`; None while a nearer one may come."""
        if not self.frames:
            return None
        newest_s = self.frames[-1][0]
        if newest_s < time_s and time_s - newest_s > self.period_s / 4.0:
            return None
        return min(range(len(self.frames)), key=lambda i: abs(self.frames[i][0] - time_s))


class Pairing(Generic[Item]):
    """Nearest neighbours in time, each frame once; the slowest camera leads.

    For every frame of the leader the nearest frame of each other camera is its partner. Together
    they are a group if their skew is at most a quarter of the period, so that no frame of another
    instant could be mistaken for one of this, and at most `max_skew_s`. The period is the one asked
    for, unless the leader is clearly faster. A decision falls as soon as no nearer frame can come:
    there is no extra delay.

    Args:
        cameras: how many.
        period_s: time from frame to frame that was asked of all of them; which of them is the
            slowest is measured.
        max_skew_s: largest time between the frames of one group.
        is_static: whether the scene stands still, so that a frame of another instant does as well:
            then only `max_skew_s` counts.
    """

    def __init__(
        self, cameras: int, *, period_s: float, max_skew_s: float, is_static: bool = False
    ) -> None:
        self._queues = [_Queue[Item](period_s) for _ in range(cameras)]
        self._asked_s = period_s
        self._max_skew_s = max_skew_s
        self._is_static = is_static
        self._leader = 0
        self._has_begun = False
        self.dropped: Counter[tuple[int, str]] = Counter()
        """Frames by camera and reason."""
        self.last_rejected_s: float | None = None
        """Skew of the latest group that was too far apart."""

    @property
    def limit_s(self) -> float:
        """Largest skew of a group at this moment."""
        return self._max_skew_s if self._is_static else min(self._max_skew_s, self._period_s / 4.0)

    @property
    def _period_s(self) -> float:
        """Period that pairs are judged by: lost frames can only make a measured one too long."""
        measured_s = self._queues[self._leader].period_s
        return measured_s if _CLEARLY * measured_s < self._asked_s else self._asked_s

    def push(self, camera: int, time_s: float, item: Item) -> Outcome[Item]:
        """Take a frame in and return all that is decided by it.

        Args:
            camera: index of the camera.
            time_s: middle of the exposure; grows from frame to frame of one camera.
            item: the frame.
        """
        outcome = Outcome[Item]()
        queue = self._queues[camera]
        if queue.last_s is not None and time_s <= queue.last_s:
            outcome.drops.append(Drop(camera, item, "order"))
        else:
            queue.push(time_s, item)
            self._begin(outcome)
            self._choose_leader()
            while self._has_begun and self._decide(outcome):
                pass
            if len(queue.frames) > _KEPT:
                self._drop_oldest(camera, "unpaired" if self._has_begun else "lead-in", outcome)
        self.dropped.update((drop.camera, drop.reason) for drop in outcome.drops)
        return outcome

    def _begin(self, outcome: Outcome[Item]) -> None:
        """Start when every camera runs; what is too old to have a partner then is the lead-in."""
        if self._has_begun or any(not queue.frames for queue in self._queues):
            return
        self._has_begun = True
        started_s = max(queue.frames[0][0] for queue in self._queues)
        for camera, queue in enumerate(self._queues):
            self._drop_before(camera, started_s - queue.period_s / 2.0, "lead-in", outcome)

    def _choose_leader(self) -> None:
        slowest = max(range(len(self._queues)), key=lambda i: self._queues[i].period_s)
        leads_s = self._queues[self._leader].period_s
        if self._queues[slowest].period_s > _CLEARLY * leads_s:
            self._leader = slowest

    def _decide(self, outcome: Outcome[Item]) -> bool:
        """Decide on the leader's oldest frame; False if that has to wait."""
        leader = self._queues[self._leader]
        if not leader.frames:
            return False
        time_s = leader.frames[0][0]
        chosen: list[int] = []
        for queue in self._queues:
            index = 0 if queue is leader else queue.nearest(time_s)
            if index is None:
                return False
            chosen.append(index)
        times_s = [q.frames[i][0] for q, i in zip(self._queues, chosen, strict=True)]
        reach_s = self._period_s / 2.0
        if any(abs(t - time_s) > reach_s for t in times_s):
            self._drop_oldest(self._leader, "unpaired", outcome)
            for camera in range(len(self._queues)):
                self._drop_before(camera, time_s - reach_s, "unpaired", outcome)
            return True
        for camera, t in enumerate(times_s):
            self._drop_before(camera, t, "unpaired", outcome)
        skew_s = max(times_s) - min(times_s)
        if skew_s > self.limit_s:
            self.last_rejected_s = skew_s
            for camera in range(len(self._queues)):
                self._drop_oldest(camera, "skew", outcome)
        else:
            outcome.groups.append(tuple(self._taken()))
        return True

    def _taken(self) -> Iterator[Item]:
        for queue in self._queues:
            yield queue.frames.popleft()[1]

    def _drop_before(self, camera: int, time_s: float, reason: str, outcome: Outcome[Item]) -> None:
        frames = self._queues[camera].frames
        while frames and frames[0][0] < time_s:
            self._drop_oldest(camera, reason, outcome)

    def _drop_oldest(self, camera: int, reason: str, outcome: Outcome[Item]) -> None:
        outcome.drops.append(Drop(camera, self._queues[camera].frames.popleft()[1], reason))
