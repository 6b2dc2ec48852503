"""One axis of a simulated Zaber device: motions, flags and settings."""

from collections.abc import Generator

from rig.profile import FirmwareConfig
from rig_sim.carriage import Carriage
from rig_sim.firmware.axes import Vector
from rig_sim.firmware.steppers import Steppers

SPEED_UNITS = 1.6384
ACCELERATION_UNITS = 1.6384e-4
HOME_TRAVELS = 1.5
"""The search for the home sensor gives up after so many times the travel."""
PRIORITY = (
    "FF", "FN", "FZ", "FH", "FV", "FO", "FC", "FM", "FD", "FQ", "FI", "FA", "FR", "FS", "FB", "FP",
    "FE", "FT", "WL", "WV", "WT", "WS", "WM", "WP", "WR", "WH", "NC", "NI", "ND", "NR", "NT", "NU",
    "NJ",
)  # fmt: skip
"""Flags, the most urgent first."""

Motion = Generator[None, None, None]
"""A motion at work; it yields while the motor turns."""


class Axis:
    """Moves a carriage; position 0 is where the home sensor closes, counting away from it."""

    def __init__(self, config: FirmwareConfig, carriage: Carriage, now_s: float) -> None:
        self.now_s = now_s
        self.steps_per_unit_mm = config.steps_per_mm
        self.values: dict[str, float] = {
            "limit.min": 0,
            "limit.max": round(config.travel_mm * config.steps_per_mm),
            "limit.home.preset": 0,
            "limit.approach.maxspeed": self._speed_of(config.homing_mm_s),
            "limit.detect.maxspeed": self._speed_of(config.homing_locate_mm_s),
            "maxspeed": self._speed_of(config.max_rate_mm_s),
            "motion.accelonly": self._acceleration_of(config.acceleration_mm_s2),
            "motion.decelonly": self._acceleration_of(config.acceleration_mm_s2),
            "resolution": 64,
            "driver.temperature": 38.5,
            "knob.enable": 1,
        }
        self._pull_off_mm = config.pull_off_mm
        self._carriage = carriage
        self.steppers = Steppers(self, carriage, 0, toward_switch=-1)
        self._motion: Motion | None = None
        self._is_homing = False
        self._has_found = False
        self.lies = 0
        self.flags: set[str] = set()
        self.power_up()

    def power_up(self) -> None:
        """Start with fresh power: no reference position."""
        self.steppers.kill(self.now_s, slips=True)
        self.steppers.forget()
        self._end()
        self.lies = 0
        self.flags = {"WR"}

    # -- limits of `Steppers` -----------------------------------------------------------------

    def max_rate_mm_s(self, axis: int) -> float:
        """See `Limits.max_rate_mm_s`; homing and moves bring their own speed."""
        return self.speed_mm_s(max(self.values["maxspeed"], self.values["limit.approach.maxspeed"]))

    def acceleration_mm_s2(self, axis: int) -> float:
        """See `Limits.acceleration_mm_s2`."""
        per_mm = ACCELERATION_UNITS * self.steps_per_unit_mm
        return max(1.0, self.values["motion.decelonly"] / per_mm)

    def steps_per_mm(self, axis: int) -> float:
        """See `Limits.steps_per_mm`."""
        return self.steps_per_unit_mm

    def speed_mm_s(self, steps: float) -> float:
        """Return a speed given in the device's own units."""
        return steps / SPEED_UNITS / self.steps_per_unit_mm

    def _speed_of(self, rate_mm_s: float) -> float:
        return round(rate_mm_s * self.steps_per_unit_mm * SPEED_UNITS)

    def _acceleration_of(self, rate_mm_s2: float) -> float:
        return round(rate_mm_s2 * self.steps_per_unit_mm * ACCELERATION_UNITS)

    # -- what it shows ------------------------------------------------------------------------

    @property
    def is_busy(self) -> bool:
        """Whether the answer says BUSY."""
        return self._motion is not None and self.lies == 0

    @property
    def position(self) -> int:
        """The counted position, microsteps."""
        at_mm = self.steppers.planned_mm if self.lies else self.steppers.position_mm(self.now_s)
        return round(at_mm[0] * self.steps_per_unit_mm)

    def sorted_flags(self) -> list[str]:
        """Return the flags, the most urgent first."""
        return sorted(self.flags, key=PRIORITY.index)

    # -- motions ------------------------------------------------------------------------------

    def move_to(self, position: int, speed: float | None) -> bool:
        """Start a motion; False if the position is outside the limits."""
        if not self.values["limit.min"] <= position <= self.values["limit.max"]:
            return False
        rate = self.values["maxspeed"] if speed is None else speed
        self._begin(self._travel(position / self.steps_per_unit_mm, self.speed_mm_s(rate)))
        return True

    def home(self) -> None:
        """Start the search for the home sensor."""
        self._begin(self._search())

    def stop(self) -> None:
        """Come to rest as fast as the acceleration allows."""
        if self._motion is not None:
            self._begin(self._brake(), is_ours=True)

    def stop_dead(self) -> None:
        """Stop at once; in motion steps are lost, and the device does not know."""
        self.steppers.kill(self.now_s, slips=True)
        self._end()

    def trip(self) -> None:
        """Run into something: stalled and stopped."""
        self.stop_dead()
        self.flags.add("FS")

    def turn_knob(self, way_mm: float) -> None:
        """Move by hand, as the knob on the motor does; whatever moves is interrupted."""
        target_mm = self.steppers.position_mm(self.now_s)[0] + way_mm
        self._begin(self._travel(target_mm, self.speed_mm_s(self.values["maxspeed"])))
        self.flags |= {"NC", "NI"}

    def take_event(self) -> None:
        """Let happen what is due: the sensor, or the end of a motion."""
        steppers, switch_s = self.steppers, self.steppers.switch_s
        if self._is_homing and switch_s is not None and switch_s <= self.now_s:
            steppers.kill(self.now_s, slips=False)
            self._has_found = True
            self._advance()
        elif steppers.end_s is not None and steppers.end_s <= self.now_s:
            steppers.finish(self.now_s)
            self._advance()

    def next_event_s(self) -> float | None:
        """Return when the next thing happens by itself."""
        switch_s = self.steppers.switch_s if self._is_homing else None
        return min((t for t in (self.steppers.end_s, switch_s) if t is not None), default=None)

    def _begin(self, motion: Motion, *, is_ours: bool = False) -> None:
        if self._motion is not None and not is_ours:
            self.flags.add("NI")
        else:
            self.flags.discard("NI")
        self._is_homing = False
        self._motion = motion
        self._advance()

    def _advance(self) -> None:
        if self._motion is not None and next(self._motion, self) is self:
            self._end()

    def _end(self) -> None:
        self._motion = None
        self._is_homing = False
        self.flags.discard("NC")
        self.steppers.flush()

    def _brake(self) -> Motion:
        self.steppers.brake(self.now_s)
        while self.steppers.end_s is not None:
            yield
        self.steppers.flush()

    def _travel(self, target_mm: float, rate_mm_s: float) -> Motion:
        yield from self._brake()
        self.steppers.add(_along(target_mm), rate_mm_s)
        if self.steppers.has_blocks:
            self.steppers.begin(self.now_s)
            while self.steppers.end_s is not None:
                yield

    def _search(self) -> Motion:
        yield from self._brake()
        way_mm = HOME_TRAVELS * self.values["limit.max"] / self.steps_per_unit_mm
        fast, slow = (self.values[f"limit.{name}.maxspeed"] for name in ("approach", "detect"))
        for speed, reach_mm in ((fast, way_mm), (slow, 2.0 * self._pull_off_mm)):
            self._is_homing, self._has_found = True, False
            yield from self._seek(-reach_mm, speed)
            self._is_homing = False
            if not self._has_found:
                self.flags.add("FS")  # at the end of the way there is only the end stop
                return
            if speed == fast:
                yield from self._leave_sensor(fast)
        self.steppers.set_counted(self.values["limit.home.preset"] / self.steps_per_unit_mm)
        self.flags -= {"WR", "FS"}

    def _leave_sensor(self, speed: float) -> Motion:
        """Go away from the sensor until it opens; a stop may have left the carriage deep in it."""
        yield from self._seek(self._pull_off_mm, speed)
        while self.steppers.is_switch_closed:
            yield from self._seek(self._pull_off_mm, speed)

    def _seek(self, way_mm: float, speed: float) -> Motion:
        self.steppers.seek(self.now_s, way_mm, self.speed_mm_s(speed))
        while self.steppers.end_s is not None:
            yield


def _along(position_mm: float) -> Vector:
    return position_mm, 0.0, 0.0
