"""Motion at constant acceleration, in closed form."""

import math
from dataclasses import dataclass, replace

SLACK_MM = 1e-9
"""Neighbouring phases meet to within rounding; nothing may slip through between them."""


@dataclass(frozen=True, slots=True)
class Phase:
    """A stretch of motion at one acceleration; the direction never changes within it."""

    start_s: float
    end_s: float
    start_mm: float
    """Position at the start."""
    velocity_mm_s: float
    """Velocity at the start."""
    acceleration_mm_s2: float

    @property
    def end_mm(self) -> float:
        """Position at the end."""
        return self.position_mm(self.end_s)

    @property
    def end_velocity_mm_s(self) -> float:
        """Velocity at the end."""
        return self.velocity_mm_s_at(self.end_s)

    def position_mm(self, t_s: float) -> float:
        """Return where it is; before the start and after the end it stands."""
        passed_s = self._passed_s(t_s)
        return (
            self.start_mm
            + self.velocity_mm_s * passed_s
            + 0.5 * self.acceleration_mm_s2 * passed_s**2
        )

    def velocity_mm_s_at(self, t_s: float) -> float:
        """Return how fast it is at a time within the phase."""
        return self.velocity_mm_s + self.acceleration_mm_s2 * self._passed_s(t_s)

    def until(self, t_s: float) -> "Phase":
        """Return the part before `t_s`."""
        return replace(self, end_s=min(self.end_s, max(self.start_s, t_s)))

    def mapped(self, *, scale: float, shift_mm: float) -> "Phase":
        """Return the same motion in coordinates `scale * position + shift_mm`."""
        return replace(
            self,
            start_mm=scale * self.start_mm + shift_mm,
            velocity_mm_s=scale * self.velocity_mm_s,
            acceleration_mm_s2=scale * self.acceleration_mm_s2,
        )

    def time_at_s(self, position_mm: float) -> float | None:
        """Return when it passes `position_mm`, None if it does not."""
        low_mm, high_mm = sorted((self.start_mm, self.end_mm))
        if not low_mm - SLACK_MM <= position_mm <= high_mm + SLACK_MM:
            return None
        way_mm = position_mm - self.start_mm
        root = math.sqrt(max(0.0, self.velocity_mm_s**2 + 2.0 * self.acceleration_mm_s2 * way_mm))
        # The sum never cancels: velocities of one phase share their sign.
        mean_mm_s = 0.5 * (self.velocity_mm_s + math.copysign(root, self.end_mm - self.start_mm))
        return self.start_s if mean_mm_s == 0.0 else self.start_s + way_mm / mean_mm_s

    def _passed_s(self, t_s: float) -> float:
        return min(max(t_s, self.start_s), self.end_s) - self.start_s


def trapezoid(
    start_s: float,
    from_mm: float,
    to_mm: float,
    *,
    speed_mm_s: float,
    acceleration_mm_s2: float,
) -> tuple[Phase, ...]:
    """Return the phases of a move from rest to rest; none if there is no way to go."""
    way_mm = abs(to_mm - from_mm)
    sign = math.copysign(1.0, to_mm - from_mm)
    top_mm_s = min(speed_mm_s, math.sqrt(acceleration_mm_s2 * way_mm))
    if top_mm_s == 0.0:
        return ()
    ramp_s = top_mm_s / acceleration_mm_s2
    ramp_mm = 0.5 * top_mm_s * ramp_s
    cruise_s = max(0.0, way_mm - 2.0 * ramp_mm) / top_mm_s
    up_s, down_s = start_s + ramp_s, start_s + ramp_s + cruise_s
    up = Phase(start_s, up_s, from_mm, 0.0, sign * acceleration_mm_s2)
    cruise = Phase(up_s, down_s, up.end_mm, sign * top_mm_s, 0.0)
    down = Phase(
        down_s,
        down_s + ramp_s,
        to_mm - sign * ramp_mm,
        sign * top_mm_s,
        -sign * acceleration_mm_s2,
    )
    return (up, cruise, down) if cruise_s > 0.0 else (up, down)


def braking(
    start_s: float, from_mm: float, velocity_mm_s: float, acceleration_mm_s2: float
) -> Phase:
    """Return the phase that brings a motion to rest."""
    return Phase(
        start_s,
        start_s + abs(velocity_mm_s) / acceleration_mm_s2,
        from_mm,
        velocity_mm_s,
        -math.copysign(acceleration_mm_s2, velocity_mm_s),
    )
