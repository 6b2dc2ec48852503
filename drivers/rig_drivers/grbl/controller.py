"""A linear stage behind a controller with GRBL 1.1 or one of its dialects."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from rig.devices import Clock
from rig.errors import DeviceLostError, StageAlarmError
from rig.profile import GrblStageConfig
from rig_drivers.grbl.dialect import AXES, Dialect, Message, Setting, standstill
from rig_drivers.grbl.homing import (
    EVERY_AXIS,
    FAILED_HOMING,
    FLUIDNC_HOMING_KEYS,
    NOT_ALONE,
    homed_every_axis,
    homing_commands,
)
from rig_drivers.grbl.link import HOLD, RESET, GrblLink
from rig_drivers.grbl.settings import (
    FLUIDNC_IDLE,
    FLUIDNC_KEYS,
    GrblAxis,
    check_axis,
    fluidnc_motor_at_rest,
    motor_at_rest,
    read_axis,
    read_fluidnc_axis,
)
from rig_drivers.stage.serial_line import SerialLine
from rig_drivers.stage.serial_stage import SerialStage, serial_line

HOLD_MARGIN_S = 2.0
"""Added to the time that braking takes."""
SETTINGS_ATTEMPTS = 4

Values = TypeVar("Values", bound=Mapping[Any, object])


def grbl_stage(config: GrblStageConfig, clock: Clock, *, name: str = "stage") -> SerialStage:
    """Return the stage of a profile, not yet opened."""
    line = serial_line(config, clock, name)
    return SerialStage(config, line, GrblController(config, line, clock, name), clock, name)


class GrblController:
    """Keeps `rig_drivers.stage.controller.Controller`.

    Moves are jogs (`$J=`): beyond its soft limits the controller refuses them without an alarm,
    they end at once on a feed hold, and they leave no modes behind. A dwell sent after a move is
    answered when the move has ended. A feed hold brakes the motion, then a reset clears whatever
    could resume; the position stays trusted if rest came before the reset.
    """

    def __init__(self, config: GrblStageConfig, line: SerialLine, clock: Clock, name: str) -> None:
        self._config = config
        self._name = name
        self._index = AXES.index(config.axis)
        self._link = GrblLink(line, clock, name)
        self._axis: GrblAxis | None = None
        self._homing = ("$H",)
        self._is_homing = False

    def connect(self) -> Mapping[str, str]:
        """See `Controller.connect`."""
        self._is_homing = False
        banner = self._link.connect()
        about = {m.kind: m.text for m in self._link.command("$I") if isinstance(m, Message)}
        options = about.get("OPT", "").partition(",")[0]
        self._homing = homing_commands(banner.dialect, options, self._config.axis)
        told = {
            "firmware": banner.dialect.value,
            "version": banner.version,
            "build": about.get("VER", ""),
            "options": about.get("OPT", ""),
        }
        if banner.dialect is Dialect.FLUIDNC:
            values = self._read_tree()
            axis = read_fluidnc_axis(values, self._config, device=self._name)
            told |= fluidnc_motor_at_rest(values[FLUIDNC_IDLE])
        else:
            settings = self._read_settings()
            axis = read_axis(settings, options, self._config, device=self._name)
            told |= motor_at_rest(settings)
        check_axis(self._config, axis, device=self._name, dialect=banner.dialect)
        self._axis = axis
        return told

    @property
    def is_homed(self) -> bool:
        """See `Controller.is_homed`."""
        return self._link.is_homed

    def begin(self) -> None:
        """See `Controller.begin`."""
        self._link.begin()

    def rest_mm(self, what: str, timeout_s: float) -> float | None:
        """See `Controller.rest_mm`."""
        rest = self._link.rest(self._index, timeout_s)
        if rest is None:
            return None
        state, machine_mm = rest
        if state != "Idle":
            raise standstill(self._name, what, state)
        return machine_mm

    def move(self, machine_mm: float) -> None:
        """See `Controller.move`."""
        feed_mm_min = self._config.speed_mm_s * 60.0
        self._link.command(f"$J=G53G21G90{self._config.axis}{machine_mm:.3f}F{feed_mm_min:.1f}")

    def confirm_end(self) -> None:
        """See `Controller.confirm_end`."""
        self._link.command("G4P0.01")

    def home(self, timeout_s: float) -> float:
        """See `Controller.home`."""
        # A controller locked by a limit heeds nothing but a reset.
        self._link.reset()
        self._link.is_homed = False
        self._is_homing = True
        self._find_switch(timeout_s)
        self._is_homing = False
        return self._opened_axis().home_mm

    def trust(self) -> None:
        """See `Controller.trust`."""
        self._link.is_homed = True

    def halt(self) -> None:
        """See `Controller.halt`."""
        was_homing, self._is_homing = self._is_homing, False
        if not was_homing:
            # Homing heeds nothing but a reset; everything else brakes on a feed hold.
            braking_s = self._config.speed_mm_s / self._opened_axis().acceleration_mm_s2
            self._link.hold(braking_s + HOLD_MARGIN_S)
        self._link.reset()

    def cancel(self) -> None:
        """See `Controller.cancel`."""
        self._link.cancel(RESET if self._is_homing else HOLD)

    def resume(self) -> None:
        """See `Controller.resume`."""
        self._link.resume()

    def motor_off(self) -> None:
        """See `Controller.motor_off`; GRBL holds at rest for $1 ms, 255 means for ever.

        `$SLP` takes the current off at once; only a reset wakes the controller up again.
        """
        self._link.command("$SLP")
        self._link.is_homed = False

    def _find_switch(self, timeout_s: float) -> None:
        """Home, by the first command that the firmware knows."""
        *single, last = self._homing
        for command in single:
            try:
                self._link.command(command, timeout_s)
            except StageAlarmError as error:
                if error.code not in NOT_ALONE:
                    raise
            else:
                return
        try:
            self._link.command(last, timeout_s)
        except StageAlarmError as error:
            if last == EVERY_AXIS and error.code in FAILED_HOMING:
                raise homed_every_axis(error, self._config.axis) from error
            raise

    def _read_settings(self) -> dict[int, float]:
        """Read the numbered settings."""

        def read() -> dict[int, float]:
            replies = self._link.command("$$")
            return {reply.number: reply.value for reply in replies if isinstance(reply, Setting)}

        return self._read_twice(read, "$$")

    def _read_tree(self) -> dict[str, str]:
        """Read FluidNC's configuration of the axis; what it does not know is empty."""
        where = f"/axes/{self._config.axis.lower()}"
        paths = {key: f"{where}/{key}" for key in (*FLUIDNC_KEYS, *FLUIDNC_HOMING_KEYS)}
        paths[FLUIDNC_IDLE] = FLUIDNC_IDLE
        return self._read_twice(
            lambda: {key: self._read_value(path) for key, path in paths.items()}, f"${where}"
        )

    def _read_value(self, path: str) -> str:
        """Return one value of FluidNC's configuration; empty where it knows none."""
        try:
            replies = self._link.command(f"${path}")
        except StageAlarmError as error:
            if not error.code.startswith("error:"):
                raise
            return ""
        # Between question and answer it may print messages of its own.
        values = [m.text for m in replies if isinstance(m, Message) and m.kind == path]
        return values[-1].strip() if values else ""

    def _read_twice(self, read: Callable[[], Values], what: str) -> Values:
        """Read until two readings agree: one damaged digit may cost a crash."""
        before: Values | None = None
        for _ in range(SETTINGS_ATTEMPTS):
            now = read()
            if now and now == before:
                return now
            before = now
        raise DeviceLostError(
            self._name,
            f"read the settings ({what}) {SETTINGS_ATTEMPTS} times, never twice alike",
            advice="check the cable for noise",
        )

    def _opened_axis(self) -> GrblAxis:
        if self._axis is None:
            raise DeviceLostError(self._name, "is not open", advice="use it inside `with`")
        return self._axis
