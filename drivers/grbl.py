"""A linear stage behind a GRBL 1.1 controller."""

import math
import threading
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from drivers.grbl_dialect import AXES, Message, Setting, home_mm, machine_range_mm
from drivers.grbl_link import HOLD, RESET, GrblLink
from drivers.serial_line import SerialLine
from rig.devices import Clock
from rig.errors import (
    ConfigError,
    DeviceError,
    DeviceLostError,
    StageAlarmError,
    StageLimitError,
    StagePositionError,
)
from rig.profile import GrblStageConfig

READING_TIMEOUT_S = 3.0
"""Longest wait for a position that should stand still."""
HOLD_MARGIN_S = 2.0
"""Added to the time that braking takes."""
SETTINGS_ATTEMPTS = 4


class GrblStage:
    """Keeps `rig.devices.Stage`.

    Moves are jogs (`$J=`): beyond its soft limits the controller refuses them without an alarm,
    they end at once on a feed hold, and they leave no modes behind. A position is approached from
    the near side over `approach_mm`: going farther by more than that goes straight, anything else
    goes too near first and comes back, so that backlash always lies on the same side. A move has
    ended when a dwell sent after it was answered and two status reports agree that the axis
    stands where it was sent.
    """

    def __init__(self, config: GrblStageConfig, clock: Clock, *, name: str = "stage") -> None:
        self._config = config
        self._clock = clock
        self._name = name
        self._axis = AXES.index(config.axis)
        self._line = SerialLine(config.port, config.baud, clock=clock, device=name)
        self._link = GrblLink(self._line, clock, name)
        self._lock = threading.RLock()
        self._identity: dict[str, str] = {"kind": "grbl", "port": config.port}
        self._settings: dict[int, float] = {}
        self._options = ""
        self._is_homed = False
        self._is_homing = False
        self._may_move = False

    # -- opening and closing ------------------------------------------------------------------

    def __enter__(self) -> Self:
        """Open the port, which resets the controller: the position is unknown until homed.

        Raises:
            DeviceNotFoundError: no such port, or no GRBL 1.1 behind it.
            ConfigError: the controller's settings do not allow what the profile asks for.
        """
        with self._lock:
            self._line.open()
            try:
                self._is_homed = self._is_homing = self._may_move = False
                banner = self._link.connect()
                self._read_identity(banner.version)
                self._settings = self._read_settings()
                self._check_settings()
            except BaseException:
                self._line.close()
                raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the stage if it may be moving, and close the port."""
        with self._lock:
            try:
                if self._may_move:
                    self._halt()
            finally:
                self._line.close()

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return dict(self._identity)

    # -- Stage --------------------------------------------------------------------------------

    @property
    def travel_mm(self) -> tuple[float, float]:
        """See `Stage.travel_mm`."""
        return self._config.travel_mm

    @property
    def position_mm(self) -> float:
        """See `Stage.position_mm`."""
        with self._lock:
            return self._read_position(self._clock.now_s() + READING_TIMEOUT_S)

    def home(self) -> None:
        """See `Stage.home`.

        Raises:
            ConfigError: the profile forbids homing.
        """
        if not self._config.may_home:
            raise ConfigError(
                f"{self._name}: asked to home, stage.may_home is false; "
                "clear the way to the reference switch and set it to true"
            )
        with self._lock:
            self._is_homed = False
            self._is_homing = self._may_move = True
            try:
                self._link.command("$H", self._config.homing_timeout_s)
                self._is_homing = False
                self._check_home()
            except BaseException as error:
                self._halt_after(error)
                raise
            self._is_homed = True
            self._may_move = False

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        """See `Stage.move_to`."""
        near_mm, far_mm = self._config.travel_mm
        if not near_mm <= position_mm <= far_mm:
            raise StageLimitError(
                self._name, wanted_mm=position_mm, travel_mm=self._config.travel_mm
            )
        with self._lock:
            deadline_s = self._clock.now_s() + timeout_s
            try:
                here_mm = self._read_position(self._clock.now_s() + READING_TIMEOUT_S)
                before_mm = position_mm - self._config.approach_mm
                if here_mm > before_mm:
                    self._go(before_mm, deadline_s)
                return self._go(position_mm, deadline_s)
            except BaseException as error:
                self._halt_after(error)
                raise

    def stop(self) -> None:
        """See `Stage.stop`; may be called from another thread while the stage moves.

        A feed hold brakes the motion, then a reset clears whatever could resume. The position
        stays trusted if rest came before the reset; otherwise the stage must be homed again.

        Raises:
            DeviceLostError: the controller did not confirm that it stands.
        """
        if not self._line.is_open:
            return
        self._link.cancel(RESET if self._is_homing else HOLD)
        with self._lock:
            try:
                self._halt()
            finally:
                self._link.resume()

    # -- moving -------------------------------------------------------------------------------

    def _go(self, position_mm: float, deadline_s: float) -> float:
        """Make one straight motion and prove its end."""
        machine_mm = self._machine_mm(position_mm)
        feed_mm_min = self._config.speed_mm_s * 60.0
        self._may_move = True
        self._link.command(f"$J=G53G21G90{self._config.axis}{machine_mm:.3f}F{feed_mm_min:.1f}")
        self._read_position(deadline_s)
        self._link.command("G4P0.01")
        reached_mm = self._read_position(self._clock.now_s() + READING_TIMEOUT_S)
        if abs(reached_mm - position_mm) > self._config.tolerance_mm:
            raise StagePositionError(
                self._name,
                wanted_mm=position_mm,
                reached_mm=reached_mm,
                tolerance_mm=self._config.tolerance_mm,
            )
        self._may_move = False
        return reached_mm

    def _read_position(self, deadline_s: float) -> float:
        """Return the distance at which the stage stands."""
        if not self._is_homed:
            raise StageAlarmError(
                self._name, "the position is not known; home the stage first", code="not homed"
            )
        try:
            state, machine_mm = self._link.position_mm(self._axis, deadline_s)
        except StageAlarmError as error:
            self._is_homed = self._is_homed and error.code == "stopped"
            raise
        if state != "Idle":
            self._is_homed = self._is_homed and state != "Alarm"
            raise StageAlarmError(
                self._name,
                f"the controller is in state {state} where Idle was expected; "
                "see what stopped it, then home again",
                code=state,
            )
        return self._distance_mm(machine_mm)

    def _halt_after(self, error: BaseException) -> None:
        """Stop because of an error, if the stage may be moving."""
        if not self._may_move:
            return
        try:
            self._halt()
        except DeviceError as failed:
            raise DeviceLostError(
                self._name,
                f"could not be stopped ({failed}); switch its supply off. "
                f"It was to be stopped because of: {error!r}",
            ) from error

    def _halt(self) -> None:
        """Bring the stage to rest and clear every queued motion."""
        was_homing, self._is_homing = self._is_homing, False
        if not was_homing:
            # Homing heeds nothing but a reset; everything else brakes on a feed hold.
            self._link.hold(self._braking_s() + HOLD_MARGIN_S)
        is_kept = self._link.reset()
        self._is_homed = self._is_homed and is_kept
        self._may_move = False

    def _braking_s(self) -> float:
        return self._config.speed_mm_s / self._settings[120 + self._axis]

    # -- coordinates --------------------------------------------------------------------------

    def _machine_mm(self, distance_mm: float) -> float:
        config = self._config
        return (distance_mm - config.distance_at_machine_zero_mm) * config.direction

    def _distance_mm(self, machine_mm: float) -> float:
        config = self._config
        return config.distance_at_machine_zero_mm + config.direction * machine_mm

    # -- the controller's settings ------------------------------------------------------------

    def _read_identity(self, version: str) -> None:
        self._identity["version"] = version
        for reply in self._link.command("$I"):
            if isinstance(reply, Message) and reply.kind == "VER":
                self._identity["build"] = reply.text
            if isinstance(reply, Message) and reply.kind == "OPT":
                self._identity["options"] = reply.text
        self._options = self._identity.get("options", "").partition(",")[0]

    def _read_settings(self) -> dict[int, float]:
        """Read the settings until two readings agree: one damaged digit may cost a crash."""
        before: dict[int, float] = {}
        for _ in range(SETTINGS_ATTEMPTS):
            replies = self._link.command("$$")
            now = {reply.number: reply.value for reply in replies if isinstance(reply, Setting)}
            if now and now == before:
                return now
            before = now
        raise DeviceLostError(
            self._name,
            f"read the settings ($$) {SETTINGS_ATTEMPTS} times, never twice alike; "
            "check the cable for noise",
        )

    def _check_settings(self) -> None:
        """Compare what the profile wants with what the controller allows."""
        config, axis = self._config, self._axis
        needed = {13, 20, 22, 23, 27, *(base + axis for base in (110, 120, 130))}
        missing = sorted(needed - set(self._settings))
        if missing:
            raise ConfigError(
                f"{self._name}: the controller has no setting "
                f"{', '.join(f'${number}' for number in missing)}; this driver needs GRBL 1.1"
            )
        for number, wanted, purpose in (
            (22, 1, "homing must be on, or no position is known"),
            (20, 1, "soft limits must be on, so that the controller refuses what is too far"),
            (13, 0, "reports must be in mm"),
        ):
            if int(self._settings[number]) & 1 != wanted:
                raise ConfigError(
                    f"{self._name}: the controller has ${number}={self._settings[number]:.0f}, "
                    f"{purpose}; send ${number}={wanted}"
                )
        rate_mm_s = self._settings[110 + axis] / 60.0
        if config.speed_mm_s > rate_mm_s * (1.0 + 1e-6):
            raise ConfigError(
                f"{self._name}: speed_mm_s is {config.speed_mm_s:.1f}, the controller's "
                f"${110 + axis} allows {rate_mm_s:.1f} mm/s; lower the one or raise the other"
            )
        self._check_travel()

    def _check_travel(self) -> None:
        config = self._config
        near_mm, far_mm = config.travel_mm
        low_mm, high_mm = machine_range_mm(self._settings, self._options, self._axis)
        ends_mm = sorted(self._distance_mm(machine_mm) for machine_mm in (low_mm, high_mm))
        if not ends_mm[0] <= near_mm - config.approach_mm <= far_mm <= ends_mm[1]:
            raise ConfigError(
                f"{self._name}: travel_mm {near_mm:.1f}..{far_mm:.1f} with approach_mm "
                f"{config.approach_mm:.1f} needs {near_mm - config.approach_mm:.1f}..{far_mm:.1f} "
                f"mm, the controller's ${130 + self._axis} allows {ends_mm[0]:.1f}.."
                f"{ends_mm[1]:.1f} mm; shorten the travel or correct "
                "distance_at_machine_zero_mm"
            )

    def _check_home(self) -> None:
        """See that homing ended where the settings say: a stray `ok` is not an end."""
        deadline_s = self._clock.now_s() + self._config.homing_timeout_s
        state, machine_mm = self._link.position_mm(self._axis, deadline_s)
        expected_mm = home_mm(self._settings, self._options, self._axis)
        if state != "Idle":
            raise StageAlarmError(
                self._name, f"homing ended in state {state}; home again", code=state
            )
        if not math.isclose(machine_mm, expected_mm, abs_tol=self._config.tolerance_mm):
            raise StagePositionError(
                self._name,
                wanted_mm=self._distance_mm(expected_mm),
                reached_mm=self._distance_mm(machine_mm),
                tolerance_mm=self._config.tolerance_mm,
            )
