"""A linear stage that speaks the Zaber ASCII protocol."""

from collections.abc import Mapping

from rig.devices import Clock
from rig.errors import ConfigError, DeviceError, DeviceLostError, StageAlarmError, StageTimeoutError
from rig.profile import ZaberStageConfig
from rig_drivers.stage.serial_line import SerialLine
from rig_drivers.stage.serial_stage import SerialStage, serial_line
from rig_drivers.stage.travel import check_speed, check_travel
from rig_drivers.zaber.link import WHOLE_DEVICE, ZaberLink
from rig_drivers.zaber.words import HARMLESS, INTERFERENCE, UNHOMED, alarm

SPEED_UNITS = 1.6384
"""A speed in a device's units over one in microsteps per second."""
ACCELERATION_UNITS = 1.6384e-4
"""An acceleration in a device's units over one in microsteps per second squared."""
SPEED_WITH_MOVE = (7, 25)
"""First firmware that takes a speed together with a move."""
POLL_S = 0.05
REREAD_S = 0.01
"""Pause between two readings of a position at rest."""
BRAKING_SLACK = 1.1
"""Homing may be somewhat faster than moves."""
UNKNOWN_BRAKING_S = 2.0
"""Where the device does not tell how it brakes: longer than any of these stages takes."""
STOP_MARGIN_S = 1.0
"""Added to the time that braking takes."""


def zaber_stage(config: ZaberStageConfig, clock: Clock, *, name: str = "stage") -> SerialStage:
    """Return the stage of a profile, not yet opened."""
    line = serial_line(config, clock, name)
    return SerialStage(config, line, ZaberController(config, line, clock, name), clock, name)


class ZaberController:
    """Keeps `rig_drivers.stage.controller.Controller`.

    The device keeps counting while the port is closed, so a reference survives opening; whether
    there is one its flags tell. An answer shows only the most urgent flag, therefore the whole list
    (`warnings`) is asked for. A flag that costs the position makes homing necessary even after it
    has gone.
    """

    def __init__(self, config: ZaberStageConfig, line: SerialLine, clock: Clock, name: str) -> None:
        self._config = config
        self._clock = clock
        self._name = name
        self._link = ZaberLink(config, line, clock, name)
        self._is_homed = False
        self._braking_s = 0.0
        self._speed = ""

    def connect(self) -> Mapping[str, str]:
        """See `Controller.connect`."""
        self._is_homed = False
        self._link.connect()
        version = self._link.ask("get version", axis=WHOLE_DEVICE).data
        about = {
            "version": version,
            "device_id": self._tell("deviceid"),
            "serial": self._tell("system.serial"),
            "address": str(self._config.device_address),
            "axis": str(self._config.axis_number),
        }
        self._check_axis_number()
        self._check_settings(version)
        flags, is_busy = self._state()
        if is_busy:
            self.halt()
        self._is_homed = not is_busy and flags <= HARMLESS | INTERFERENCE
        self._link.ask("warnings clear")
        return about

    @property
    def is_homed(self) -> bool:
        """See `Controller.is_homed`."""
        return self._is_homed

    def begin(self) -> None:
        """See `Controller.begin`."""
        self._link.dialogue.begin()

    def rest_mm(self, what: str, timeout_s: float) -> float | None:
        """See `Controller.rest_mm`."""
        deadline_s = self._clock.now_s() + timeout_s
        before: int | None = None
        while True:
            flags, is_busy = self._state()
            self._check(flags, what)
            steps: int | None = None
            if not is_busy:
                steps = round(self._link.number("pos"))
                if steps == before:
                    return steps * self._config.microstep_mm
            before = steps
            left_s = deadline_s - self._clock.now_s()
            if left_s <= 0.0:
                return None
            self._clock.sleep_s(min(left_s, POLL_S if is_busy else REREAD_S))

    def move(self, machine_mm: float) -> None:
        """See `Controller.move`; the answer comes at the start of the motion."""
        steps = round(machine_mm / self._config.microstep_mm)
        self._link.ask(f"move abs {steps}{self._speed}", attempts=1)

    def confirm_end(self) -> None:
        """See `Controller.confirm_end`; a device queues nothing, an idle axis has nothing left."""
        if self._link.ask("").is_busy:
            raise StageAlarmError(
                self._name,
                "the axis began to move by itself",
                advice="end other programs that use the chain",
                code="BUSY",
            )

    def home(self, timeout_s: float) -> float:
        """See `Controller.home`."""
        self._is_homed = False
        flags, _ = self._state()
        if any(flag in {"FO", "FD", "FH", "FV"} for flag in flags):
            # Where the firmware does not know this, homing itself switches the motor on.
            self._link.knows("driver enable")
        self._link.ask("warnings clear")
        self._link.ask("home", attempts=1)
        deadline_s = self._clock.now_s() + timeout_s
        while True:
            flags, is_busy = self._state()
            self._check(flags if not is_busy else flags - UNHOMED, "asked to home")
            if not is_busy:
                home = self._link.number_if_known("limit.home.preset")
                # A firmware without this setting does not tell where homing should end.
                home = self._link.number("pos") if home is None else home
                return home * self._config.microstep_mm
            if self._clock.now_s() >= deadline_s:
                raise StageTimeoutError(
                    self._name,
                    f"homing did not end within {timeout_s:.1f} s, stopped",
                    advice="check the home sensor or raise homing_timeout_s",
                    timeout_s=timeout_s,
                )
            self._clock.sleep_s(POLL_S)

    def trust(self) -> None:
        """See `Controller.trust`."""
        self._is_homed = True

    def halt(self) -> None:
        """See `Controller.halt`: brake; if that does not help, stop dead, which may lose steps."""
        if self._comes_to_rest("stop"):
            return
        self._is_homed = False
        if not self._comes_to_rest("estop"):
            raise DeviceLostError(
                self._name,
                f"does not confirm that it stands{self._link.dialogue.noise_note()}",
                advice="the stage may still be moving: switch its supply off",
            )

    def cancel(self) -> None:
        """See `Controller.cancel`."""
        self._link.dialogue.cancel()
        self._link.send_stop()

    def resume(self) -> None:
        """See `Controller.resume`."""
        self._link.dialogue.resume()

    def motor_off(self) -> None:
        """See `Controller.motor_off`."""
        if self._link.knows("driver disable") is None:
            raise ConfigError(
                f"{self._name}: motor_off_at_end is true, the device's firmware knows no "
                "`driver disable`",
                advice="update the firmware, or set it to false",
            )
        self._is_homed = False

    # -- state --------------------------------------------------------------------------------

    def _state(self, *, heeds: bool = True) -> tuple[frozenset[str], bool]:
        """Return all flags, and whether the axis moves."""
        answer = self._link.ask("warnings", heeds=heeds)
        count, *flags = answer.data.split() or ["00"]
        if not count.isdigit() or int(count) != len(flags):
            raise StageAlarmError(
                self._name,
                f"asked for the flags, found {answer.data!r}",
                advice="check axis_number and firmware",
                code="BADDATA",
            )
        return frozenset(flags), answer.is_busy

    def _check(self, flags: frozenset[str], what: str) -> None:
        """Raise for flags under which the board may not be where it should."""
        serious = sorted(flags - HARMLESS, key=lambda flag: ("FWN".find(flag[0]), flag))
        if not serious:
            return
        if not flags <= HARMLESS | INTERFERENCE:
            self._is_homed = False
        elif "NI" in flags:
            self._link.ask("warnings clear")  # told once; the next call begins anew
        raise alarm(self._name, what, serious[0])

    def _comes_to_rest(self, command: str) -> bool:
        """Send a stop and see whether the axis stands soon after; asks whatever has been heard."""
        deadline_s = self._clock.now_s() + self._braking_s + STOP_MARGIN_S
        try:
            self._link.ask(command, heeds=False)
            # A stop that was taken has worked after this time, whatever the device says of it.
            self._clock.sleep_s(self._braking_s)
            while self._state(heeds=False)[1]:
                if self._clock.now_s() >= deadline_s:
                    return False
                self._clock.sleep_s(POLL_S)
            # Stopping a motion leaves the flag of an interrupted one; this one was ours.
            if self._link.ask("warnings clear", heeds=False).is_busy:
                return False
        except DeviceLostError:
            raise
        except DeviceError:
            return False
        return True

    # -- settings -----------------------------------------------------------------------------

    def _tell(self, setting: str) -> str:
        """Return what the device says of itself; nothing where its firmware does not know."""
        answer = self._link.knows(f"get {setting}", axis=WHOLE_DEVICE)
        return "" if answer is None else answer.data

    def _check_axis_number(self) -> None:
        count = self._link.number_if_known("system.axiscount", axis=WHOLE_DEVICE)
        if count is not None and self._config.axis_number > count:
            raise ConfigError(
                f"{self._name}: axis_number is {self._config.axis_number}, device "
                f"{self._config.device_address} has {count:.0f} axes",
                advice="correct the number",
            )

    def _check_settings(self, version: str) -> None:
        """See that limits and speed allow what the profile asks for."""
        step_mm = self._config.microstep_mm
        low, high = (self._link.number_if_known(f"limit.{end}") for end in ("min", "max"))
        if low is not None and high is not None:  # else the device alone refuses what is too far
            ends_mm = (low * step_mm, high * step_mm)
            check_travel(self._config, ends_mm, setting="limit.min, limit.max", device=self._name)
        fastest_mm_s = self._link.number("maxspeed") * step_mm / SPEED_UNITS
        check_speed(self._config, fastest_mm_s, setting="maxspeed", device=self._name)
        speed = round(self._config.speed_mm_s / step_mm * SPEED_UNITS)
        if _number_of(version) >= SPEED_WITH_MOVE:
            self._speed = f" {speed}"
        elif fastest_mm_s <= self._config.speed_mm_s * 1.01:
            self._speed = ""
        else:
            raise ConfigError(
                f"{self._name}: speed_mm_s is {self._config.speed_mm_s:.1f}, the device moves at "
                f"{fastest_mm_s:.1f} mm/s and its firmware {version} takes no speed with a move",
                advice=f"send `/{self._config.device_address} {self._config.axis_number} "
                f"set maxspeed {speed}`",
            )
        self._braking_s = self._time_to_brake_s(fastest_mm_s)

    def _time_to_brake_s(self, fastest_mm_s: float) -> float:
        for setting in ("motion.decelonly", "accel"):  # older firmware has only the second
            braking = self._link.number_if_known(setting)
            if braking is not None:
                # 0 stands for the hardest braking there is.
                rate_mm_s2 = braking * self._config.microstep_mm / ACCELERATION_UNITS
                return BRAKING_SLACK * fastest_mm_s / rate_mm_s2 if braking else 0.0
        return UNKNOWN_BRAKING_S


def _number_of(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split(".") if part.isdigit())
