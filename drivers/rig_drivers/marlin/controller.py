"""A linear stage behind a Marlin controller."""

import re
from collections.abc import Mapping

from rig.devices import Clock
from rig.errors import (
    ConfigError,
    DeviceError,
    DeviceLostError,
    DeviceNotFoundError,
    StageAlarmError,
    StageTimeoutError,
)
from rig.profile import MarlinStageConfig
from rig_drivers.marlin.dialect import KILLED, KLIPPER, klipper
from rig_drivers.marlin.link import ANSWER_TIMEOUT_S, MarlinLink
from rig_drivers.marlin.settings import MarlinAxis, read_axis, travel_time_s
from rig_drivers.stage.serial_line import SerialLine
from rig_drivers.stage.serial_stage import SerialStage, serial_line
from rig_drivers.stage.travel import check_speed, check_travel

QUICK_STOP = b"M410"
EMERGENCY_STOP = b"M112"
IDLE_OFF_S = 120.0
"""Motors lose their current after so long at rest, unless told not to (M84 S0)."""
POLL_S = 0.25
"""Time between two signs of life during a motion."""
REREAD_S = 0.01
"""Pause between two readings of a position at rest."""
ROUNDING_MM = 0.0051
"""Coordinates are printed in hundredths."""
SETTINGS_ATTEMPTS = 4
READING_ATTEMPTS = 6


def marlin_stage(config: MarlinStageConfig, clock: Clock, *, name: str = "stage") -> SerialStage:
    """Return the stage of a profile, not yet opened."""
    line = serial_line(config, clock, name)
    return SerialStage(config, line, MarlinController(config, line, clock, name), clock, name)


class MarlinController:
    """Keeps `rig_drivers.stage.controller.Controller`.

    A controller tells the planned position, and that a motion has ended only by answering M400.
    Until its calculated end a motion is only watched, so that the line is free for a quick stop;
    after it M400 waits for what is left. A quick stop (M410) does not brake: where it hits a motion
    the position is lost. Homing goes on after a quick stop, so it is ended by M112, after which the
    controller wants a reset.
    """

    def __init__(
        self, config: MarlinStageConfig, line: SerialLine, clock: Clock, name: str
    ) -> None:
        self._config = config
        self._clock = clock
        self._name = name
        self._link = MarlinLink(line, clock, name)
        self._axis: MarlinAxis | None = None
        self._ends_s = 0.0
        self._at_mm: float | None = None
        self._is_homing = False
        self._is_moving = False
        self._idle_s: float | None = None

    def connect(self) -> Mapping[str, str]:
        """See `Controller.connect`."""
        self._is_homing = self._is_moving = False
        self._at_mm = None
        self._link.connect()
        about = self._ask_who()
        self._link.command("M113 S1")
        self._keep_current()
        axis = self._read_settings()
        check_speed(self._config, axis.rate_mm_s, setting="M203", device=self._name)
        check_travel(self._config, axis.range_mm, setting="M211", device=self._name)
        self._axis = axis
        return about

    @property
    def is_homed(self) -> bool:
        """See `Controller.is_homed`."""
        return self._link.is_homed

    def begin(self) -> None:
        """See `Controller.begin`."""
        self._link.begin()
        if self._link.is_killed:
            raise StageAlarmError(
                self._name,
                f"the controller has halted (kill): {self._link.fault}",
                advice="clear its cause, switch it off and on, open it again, then home",
                code=KILLED,
            )
        if self._idle_s is not None and self._clock.now_s() - self._ends_s > self._idle_s:
            # Nobody can say whether the motors have lost their current meanwhile.
            self._link.is_homed = False

    def rest_mm(self, what: str, timeout_s: float) -> float | None:
        """See `Controller.rest_mm`."""
        deadline_s = self._clock.now_s() + timeout_s
        while (now_s := self._clock.now_s()) < min(self._ends_s, deadline_s):
            self._link.position()
            self._clock.sleep_s(min(POLL_S, self._ends_s - now_s, deadline_s - now_s))
        left_s = deadline_s - self._clock.now_s()
        if self._is_moving and left_s <= 0.0:
            return None
        # At rest there is nothing to wait for, only a lost answer to be asked for again.
        longest_s = max(left_s, REREAD_S) if self._is_moving else ANSWER_TIMEOUT_S
        try:
            self._link.command("M400", longest_s)
        except StageTimeoutError:
            if not self._is_moving or self._clock.now_s() < deadline_s:
                raise
            return None
        self._at_mm = self._read_mm(what)
        return self._at_mm

    def move(self, machine_mm: float) -> None:
        """See `Controller.move`."""
        axis, speed_mm_s = self._opened_axis(), self._config.speed_mm_s
        way_mm = abs(machine_mm - (machine_mm if self._at_mm is None else self._at_mm))
        self._at_mm = None
        self._is_moving = True
        self._link.command(f"G1 {self._config.axis}{machine_mm:.4f} F{speed_mm_s * 60.0:.1f}")
        time_s = travel_time_s(way_mm, speed_mm_s, axis.acceleration_mm_s2)
        self._ends_s = self._clock.now_s() + time_s

    def confirm_end(self) -> None:
        """See `Controller.confirm_end`."""
        self._link.command("M400")
        self._link.speak_up(is_certain=True)
        self._is_moving = False

    def home(self, timeout_s: float) -> float:
        """See `Controller.home`.

        Marlin does not tell where homing should end; that it has ended the token proves.
        """
        self._link.is_homed = False
        self._is_homing = self._is_moving = True
        if self._link.is_stopped:
            self._link.is_stopped = False
            self._link.command("M999 S1")
        for modes in ("G21", "G90", "M220 S100"):
            self._link.command(modes)
        self._link.command(f"G28 {self._config.axis}", timeout_s)
        self._link.speak_up(is_certain=True)
        self._is_homing = self._is_moving = False
        self._ends_s = self._clock.now_s()
        return self._read_mm("asked to home")

    def trust(self) -> None:
        """See `Controller.trust`."""
        self._link.is_homed = True

    def halt(self) -> None:
        """See `Controller.halt`."""
        was_homing, self._is_homing = self._is_homing, False
        was_moving, self._is_moving = self._is_moving, False
        self._ends_s = self._clock.now_s()
        self._at_mm = None
        if was_moving:
            self._link.is_homed = False
        if self._link.halts():
            return
        if was_homing:
            self._link.kill()
            return
        self._link.urge(QUICK_STOP)
        try:
            # Once more with number and checksum: an urgent one may have been damaged.
            self._link.command(QUICK_STOP.decode(), heeds=False)
            self._link.speak_up(heeds=False)
        except DeviceLostError:
            raise
        except DeviceError:
            if not self._link.is_killed:
                self._link.kill()

    def cancel(self) -> None:
        """See `Controller.cancel`."""
        self._link.cancel(EMERGENCY_STOP if self._is_homing else QUICK_STOP)

    def resume(self) -> None:
        """See `Controller.resume`."""
        self._link.resume()

    def motor_off(self) -> None:
        """See `Controller.motor_off`."""
        if not self._link.is_killed:
            self._link.command(f"M18 {self._config.axis}")
        self._link.is_homed = False

    # -- the controller -----------------------------------------------------------------------

    def _ask_who(self) -> dict[str, str]:
        text = " ".join(self._link.ask("M115", "FIRMWARE_NAME"))
        name = re.search(r"FIRMWARE_NAME:\s*(.*?)(?= [A-Z_]+:|$)", text)
        if name is not None and KLIPPER in name[1]:
            raise klipper(self._name, f"M115: {name[1]}")
        if name is None or "Marlin" not in name[1]:
            raise DeviceNotFoundError(
                self._name,
                f"asked for Marlin, found {name[1] if name else 'no name'!r} (M115)",
                advice="check the port, or choose another kind of stage",
            )
        parts = {"machine": r"MACHINE_TYPE:\s*(.*?)(?= [A-Z_]+:|$)", "uuid": r"UUID:\s*(\S+)"}
        found = {key: re.search(pattern, text) for key, pattern in parts.items()}
        emergency = "yes" if "EMERGENCY_PARSER:1" in text else "no"
        return {
            "version": name[1],
            **{key: match[1] if match else "" for key, match in found.items()},
            "emergency_parser": emergency,
        }

    def _keep_current(self) -> None:
        """Have the motors keep their current at rest, or take note that they may lose it."""
        self._idle_s = None
        try:
            self._link.command("M84 S0")
        except StageAlarmError as error:
            if error.code != "unknown command":
                raise
            self._idle_s = IDLE_OFF_S

    def _read_settings(self) -> MarlinAxis:
        """Read the settings until two readings agree: one damaged digit may cost a crash."""
        before: MarlinAxis | None = None
        trouble: ConfigError | None = None
        for _ in range(SETTINGS_ATTEMPTS):
            texts = [*self._link.ask("M503", "M92"), *self._link.ask("M211", "Max:")]
            try:
                now = read_axis(texts, self._config.axis, device=self._name)
            except ConfigError as error:
                if trouble is not None and str(error) == str(trouble):
                    raise
                trouble = error
                continue
            if now == before:
                return now
            before = now
        raise DeviceLostError(
            self._name,
            f"read the settings (M503, M211) {SETTINGS_ATTEMPTS} times, never twice alike",
            advice="check the cable for noise",
        )

    def _read_mm(self, what: str) -> float:
        """Return the coordinate, read twice alike, from the step count: it is finer than digits."""
        before: float | None = None
        for _ in range(READING_ATTEMPTS):
            position = self._link.position()
            if position.steps is None:
                raise ConfigError(
                    f"{self._name}: motors of this controller are no axes (CoreXY)",
                    advice=f"use a controller whose {self._config.axis} motor drives the carriage",
                )
            index = self._index_in(position.axes)
            now = position.steps[index] / self._opened_axis().steps_per_mm
            agrees = abs(now - position.logical_mm[index]) <= ROUNDING_MM
            if agrees and now == before:
                return now
            before = now if agrees else None
            self._clock.sleep_s(REREAD_S)
        raise StageAlarmError(
            self._name,
            f"{what}, {READING_ATTEMPTS} readings of M114 disagree, or its coordinate with its "
            "count",
            advice="switch off offsets (M206, G92) and levelling (M420 S0), check the cable",
            code="M114",
        )

    def _index_in(self, axes: str) -> int:
        if self._config.axis not in axes:
            raise ConfigError(
                f"{self._name}: axis is {self._config.axis}, the controller has "
                f"{', '.join(axes)} (M114)",
                advice="correct the axis",
            )
        return axes.index(self._config.axis)

    def _opened_axis(self) -> MarlinAxis:
        if self._axis is None:
            raise DeviceLostError(self._name, "is not open", advice="use it inside `with`")
        return self._axis
