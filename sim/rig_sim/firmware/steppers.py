"""Planner and steppers of a simulated controller: queued blocks become motion in time."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from rig_sim.carriage import Carriage
from rig_sim.firmware.axes import Vector
from rig_sim.motion import Phase, braking, trapezoid

PLANNER_BLOCKS = 15
LEAST_FEED_MM_S = 1.0 / 60.0
"""Nothing is planned slower than 1 mm per minute."""


class Limits(Protocol):
    """What the controller's settings say of each axis."""

    def max_rate_mm_s(self, axis: int) -> float:
        """Return its fastest motion."""
        ...

    def acceleration_mm_s2(self, axis: int) -> float:
        """Return its acceleration."""
        ...

    def steps_per_mm(self, axis: int) -> float:
        """Return its resolution."""
        ...


@dataclass(frozen=True, slots=True)
class _Motion:
    """One straight way through the axes; the phases run along it from 0 to its length."""

    start_mm: Vector
    target_mm: Vector
    phases: tuple[Phase, ...]
    acceleration_mm_s2: float
    switch_s: float | None = None
    """When the reference switch closes, if it does."""
    is_braking: bool = False

    @property
    def length_mm(self) -> float:
        return math.dist(self.start_mm, self.target_mm)

    @property
    def direction(self) -> Vector:
        return _vector(
            [(b - a) / self.length_mm for a, b in zip(self.start_mm, self.target_mm, strict=True)]
        )

    def phase_at(self, t_s: float) -> Phase:
        return next((p for p in self.phases if t_s < p.end_s), self.phases[-1])

    def position_mm(self, t_s: float) -> Vector:
        way_mm = self.phase_at(t_s).position_mm(t_s)
        return _vector([a + u * way_mm for a, u in zip(self.start_mm, self.direction, strict=True)])


class Steppers:
    """Runs blocks one after the other, each from rest to rest.

    Real planners carry speed through junctions of the same direction; here every block stops, which
    makes chains of blocks a little slower and changes nothing for single moves.

    Args:
        limits: rates, accelerations and resolutions.
        carriage: what the carried axis moves.
        axis: index of the carried axis.
        toward_switch: sign of its coordinate's change on the way to the reference switch.
    """

    def __init__(
        self, limits: Limits, carriage: Carriage, axis: int, *, toward_switch: int = 1
    ) -> None:
        self._limits = limits
        self._sign = toward_switch
        self._carriage = carriage
        self._axis = axis
        self._counted_mm: Vector = (0.0, 0.0, 0.0)
        self._origin_mm = carriage.power_up_mm
        self._queue: deque[tuple[Vector, float | None]] = deque()
        self._motion: _Motion | None = None

    @property
    def is_full(self) -> bool:
        """Whether the planner takes no more blocks."""
        return len(self._queue) >= PLANNER_BLOCKS

    @property
    def free_blocks(self) -> int:
        """How many blocks the planner still takes."""
        return PLANNER_BLOCKS - len(self._queue)

    @property
    def has_blocks(self) -> bool:
        """Whether anything is queued or running."""
        return bool(self._queue)

    @property
    def planned_mm(self) -> Vector:
        """Where the last queued block ends."""
        return self._queue[-1][0] if self._queue else self._counted_mm

    @property
    def end_s(self) -> float | None:
        """When the running motion ends; None at rest."""
        return None if self._motion is None else self._motion.phases[-1].end_s

    @property
    def switch_s(self) -> float | None:
        """When the running motion closes the reference switch, if it does."""
        return None if self._motion is None else self._motion.switch_s

    @property
    def is_switch_closed(self) -> bool:
        """Whether the carriage presses the reference switch; at rest only."""
        return self._carriage.has_switch and self._carriage.switch_gap_mm() == 0.0

    def position_mm(self, t_s: float) -> Vector:
        """Return the counted machine coordinates, in whole steps."""
        if self._motion is None:
            return self._counted_mm
        return self._in_steps(self._motion.position_mm(t_s))

    def speed_mm_s(self, t_s: float) -> float:
        """Return the speed along the path."""
        if self._motion is None:
            return 0.0
        return abs(self._motion.phase_at(t_s).velocity_mm_s_at(t_s))

    def add(self, target_mm: Vector, feed_mm_s: float | None) -> None:
        """Queue a block; one without any way to go is left out, as GRBL does."""
        target_mm = self._in_steps(target_mm)
        if target_mm != self.planned_mm:
            self._queue.append((target_mm, feed_mm_s))

    def begin(self, t_s: float) -> None:
        """Start the first queued block from rest."""
        target_mm, feed_mm_s = self._queue[0]
        self._run(t_s, target_mm, feed_mm_s)

    def seek(self, t_s: float, way_mm: float, speed_mm_s: float) -> None:
        """Move the carried axis past all limits, as homing does."""
        target = list(self._counted_mm)
        target[self._axis] += way_mm
        target_mm = self._in_steps(_vector(target))
        if target_mm != self._counted_mm:
            self._run(t_s, target_mm, speed_mm_s)

    def brake(self, t_s: float) -> None:
        """Come to rest as fast as the acceleration allows."""
        motion = self._motion
        if motion is None or motion.is_braking:
            return
        phase = motion.phase_at(t_s)
        speed_mm_s = phase.velocity_mm_s_at(t_s)
        way_mm = phase.position_mm(t_s)
        stop = braking(t_s, way_mm, speed_mm_s, motion.acceleration_mm_s2)
        ends_anyway = stop.end_mm >= motion.length_mm - 1e-6
        phases = motion.phases if ends_anyway else (stop,)
        self._motion = _Motion(
            motion.start_mm,
            motion.target_mm,
            phases,
            motion.acceleration_mm_s2,
            motion.switch_s,
            is_braking=True,
        )
        if not ends_anyway:
            self._drive(phases)

    def finish(self, t_s: float) -> None:
        """Take note of the end of a motion; a block cut short stays queued with its rest."""
        self._counted_mm = self.position_mm(t_s)
        self._motion = None
        if self._queue and self._queue[0][0] == self._counted_mm:
            self._queue.popleft()

    def kill(self, t_s: float, *, slips: bool) -> None:
        """Stop dead; the count goes on from where it was, whether the motor did or not."""
        if self._motion is not None:
            self._carriage.halt(t_s, slips=slips)
            self._counted_mm = self.position_mm(t_s)
            self._motion = None

    def flush(self) -> None:
        """Forget all queued blocks."""
        self._queue.clear()

    def set_counted(self, axis_mm: float) -> None:
        """Give the carried axis a new machine coordinate where it stands."""
        counted = list(self._counted_mm)
        self._origin_mm += self._sign * (counted[self._axis] - axis_mm)
        counted[self._axis] = axis_mm
        self._counted_mm = self._in_steps(_vector(counted))

    def forget(self) -> None:
        """Lose all counts, as a power-up does."""
        self.flush()
        self._origin_mm += self._sign * self._counted_mm[self._axis]
        self._counted_mm = (0.0, 0.0, 0.0)

    def _run(self, t_s: float, target_mm: Vector, feed_mm_s: float | None) -> None:
        way = [b - a for a, b in zip(self._counted_mm, target_mm, strict=True)]
        length_mm = math.hypot(*way)
        shares = [abs(w) / length_mm for w in way]
        limits = self._limits
        rate_mm_s = min(limits.max_rate_mm_s(i) / s for i, s in enumerate(shares) if s)
        acceleration = min(limits.acceleration_mm_s2(i) / s for i, s in enumerate(shares) if s)
        speed_mm_s = rate_mm_s if feed_mm_s is None else min(rate_mm_s, feed_mm_s)
        phases = trapezoid(
            t_s,
            0.0,
            length_mm,
            speed_mm_s=max(speed_mm_s, LEAST_FEED_MM_S),
            acceleration_mm_s2=acceleration,
        )
        switch_s = self._switch_time_s(phases, self._sign * way[self._axis] / length_mm)
        self._motion = _Motion(self._counted_mm, target_mm, phases, acceleration, switch_s)
        self._drive(phases)

    def _drive(self, phases: Sequence[Phase]) -> None:
        motion = self._motion
        if motion is not None and motion.direction[self._axis] != 0.0:
            shift_mm = self._sign * motion.start_mm[self._axis] + self._origin_mm
            scale = self._sign * motion.direction[self._axis]
            self._carriage.follow([p.mapped(scale=scale, shift_mm=shift_mm) for p in phases])

    def _switch_time_s(self, phases: Sequence[Phase], share: float) -> float | None:
        if share <= 0.0 or not self._carriage.has_switch:
            return None
        way_mm = self._carriage.switch_gap_mm() / share
        times_s = (phase.time_at_s(way_mm) for phase in phases)
        return next((t for t in times_s if t is not None), None)

    def _in_steps(self, position_mm: Vector) -> Vector:
        scales = [self._limits.steps_per_mm(i) for i in range(3)]
        return _vector([round(p * s) / s for p, s in zip(position_mm, scales, strict=True)])


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = values
    return x, y, z
