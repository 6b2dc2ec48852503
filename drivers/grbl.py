"""A linear stage behind a GRBL 1.1 controller."""

import math
import threading
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from drivers.grbl_dialect import AXES, Message, Setting
from drivers.grbl_link import HOLD, RESET, GrblLink
from drivers.grbl_settings import GrblAxis, check_axis, distance_mm, machine_mm, read_axis
from drivers.serial_line import SerialLine
from rig.devices import Clock
from rig.errors import (
    ConfigError,
    DeviceError,
    DeviceLostError,
    StageAlarmError,
    StageLimitError,
    StagePositionError,
    StageTimeoutError,
)
from rig.profile import GrblStageConfig

READING_TIMEOUT_S = 3.0
"""Longest wait for the position of a stage that should stand."""
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
    stands where it was sent. On every way out of a call that moves, the stage stands.
    """

    def __init__(self, config: GrblStageConfig, clock: Clock, *, name: str = "stage") -> None:
        self._config = config
        self._clock = clock
        self._name = name
        self._index = AXES.index(config.axis)
        self._line = SerialLine(config.port, config.baud, clock=clock, device=name)
        self._link = GrblLink(self._line, clock, name)
        self._lock = threading.RLock()
        self._identity: dict[str, str] = {"kind": "grbl", "port": config.port}
        self._axis: GrblAxis | None = None
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
                self._is_homing = self._may_move = False
                self._connect()
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
                # After DeviceLostError stopping has been tried; what it said must not be hidden.
                if self._may_move and not isinstance(error, DeviceLostError):
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
            self._link.begin()
            return self._read_position("asked for the position", READING_TIMEOUT_S)

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
            self._link.begin()
            try:
                # A controller locked by a limit heeds nothing but a reset.
                self._link.reset()
                self._link.is_homed = False
                self._is_homing = self._may_move = True
                self._link.command("$H", self._config.homing_timeout_s)
                self._is_homing = False
                self._check_home()
            except BaseException as error:
                self._halt_after(error)
                raise
            self._link.is_homed = True
            self._may_move = False

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        """See `Stage.move_to`."""
        near_mm, far_mm = self._config.travel_mm
        if not near_mm <= position_mm <= far_mm:
            raise StageLimitError(
                self._name, wanted_mm=position_mm, travel_mm=self._config.travel_mm
            )
        with self._lock:
            self._link.begin()
            deadline_s = self._clock.now_s() + timeout_s
            try:
                here_mm = self._read_position("before the move", READING_TIMEOUT_S)
                before_mm = position_mm - self._config.approach_mm
                what = f"asked for {position_mm:.3f} mm within {timeout_s:.1f} s"
                if here_mm > before_mm:
                    self._go(before_mm, deadline_s, what)
                return self._go(position_mm, deadline_s, what)
            except BaseException as error:
                self._halt_after(error)
                raise

    def stop(self) -> None:
        """See `Stage.stop`; may be called from another thread or a signal handler in a move.

        The call that moves then ends with StageAlarmError, code "stopped".

        A feed hold brakes the motion, then a reset clears whatever could resume. The position
        stays trusted if rest came before the reset; otherwise the stage must be homed again.

        Raises:
            DeviceLostError: the controller did not confirm that it stands.
        """
        if not self._line.is_open:
            return
        try:
            self._link.cancel(RESET if self._is_homing else HOLD)
            with self._lock:
                if self._line.is_open:
                    self._halt()
        finally:
            self._link.resume()

    # -- moving -------------------------------------------------------------------------------

    def _go(self, wanted_mm: float, deadline_s: float, what: str) -> float:
        """Make one straight motion and prove its end."""
        feed_mm_min = self._config.speed_mm_s * 60.0
        target_mm = machine_mm(self._config, wanted_mm)
        self._may_move = True
        self._link.command(f"$J=G53G21G90{self._config.axis}{target_mm:.3f}F{feed_mm_min:.1f}")
        self._read_position(what, max(0.0, deadline_s - self._clock.now_s()))
        self._link.command("G4P0.01")
        reached_mm = self._read_position(what, READING_TIMEOUT_S)
        self._check_reached(wanted_mm, reached_mm)
        self._may_move = False
        return reached_mm

    def _read_position(self, what: str, timeout_s: float) -> float:
        """Return the distance at which the stage comes to rest.

        Args:
            what: what was asked of the stage, for the error.
            timeout_s: longest wait for rest.
        """
        if not self._link.is_homed:
            raise StageAlarmError(
                self._name, "the position is not known; home the stage first", code="not homed"
            )
        rest = self._link.rest(self._index, timeout_s)
        if rest is None:
            raise StageTimeoutError(
                self._name,
                f"{what}, still not at rest, stopped; allow more time or raise the speed",
                timeout_s=timeout_s,
            )
        self._check_idle(rest[0], what)
        return distance_mm(self._config, rest[1])

    def _check_idle(self, state: str, what: str) -> None:
        if state != "Idle":
            raise StageAlarmError(
                self._name,
                f"{what}, found the controller in state {state}; "
                "see what stopped it, then home again",
                code=state,
            )

    def _check_reached(self, wanted_mm: float, reached_mm: float) -> None:
        tolerance_mm = self._config.tolerance_mm
        if not math.isclose(wanted_mm, reached_mm, rel_tol=0.0, abs_tol=tolerance_mm):
            raise StagePositionError(
                self._name,
                wanted_mm=wanted_mm,
                reached_mm=reached_mm,
                tolerance_mm=tolerance_mm,
            )

    def _check_home(self) -> None:
        """See that homing ended where the settings say: a stray `ok` is not an end."""
        timeout_s = self._config.homing_timeout_s
        rest = self._link.rest(self._index, timeout_s)
        if rest is None:
            raise StageTimeoutError(
                self._name,
                f"homing did not end within {timeout_s:.1f} s, stopped; "
                "check the reference switch or raise homing_timeout_s",
                timeout_s=timeout_s,
            )
        self._check_idle(rest[0], "asked to home")
        home_mm = distance_mm(self._config, self._opened_axis().home_mm)
        self._check_reached(home_mm, distance_mm(self._config, rest[1]))

    # -- stopping -----------------------------------------------------------------------------

    def _halt_after(self, error: BaseException) -> None:
        """Stop because of an error, if the stage may be moving."""
        if not self._may_move:
            return
        try:
            self._halt()
        except DeviceError as failed:
            said, then = (str(e).removeprefix(f"{self._name}: ") for e in (error, failed))
            raise DeviceLostError(
                self._name, f"{said or type(error).__name__}; could not be stopped: {then}"
            ) from error

    def _halt(self) -> None:
        """Bring the stage to rest and clear every queued motion."""
        was_homing, self._is_homing = self._is_homing, False
        if not was_homing:
            # Homing heeds nothing but a reset; everything else brakes on a feed hold.
            braking_s = self._config.speed_mm_s / self._opened_axis().acceleration_mm_s2
            self._link.hold(braking_s + HOLD_MARGIN_S)
        self._link.reset()
        self._may_move = False

    # -- the controller -----------------------------------------------------------------------

    def _connect(self) -> None:
        """Learn who and what the controller is."""
        banner = self._link.connect()
        about = {m.kind: m.text for m in self._link.command("$I") if isinstance(m, Message)}
        self._identity = {
            "kind": "grbl",
            "port": self._config.port,
            "version": banner.version,
            "build": about.get("VER", ""),
            "options": about.get("OPT", ""),
        }
        options = about.get("OPT", "").partition(",")[0]
        axis = read_axis(self._read_settings(), options, self._config, device=self._name)
        check_axis(self._config, axis, device=self._name)
        self._axis = axis

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

    def _opened_axis(self) -> GrblAxis:
        if self._axis is None:
            raise DeviceLostError(self._name, "is not open; use it inside `with`")
        return self._axis
