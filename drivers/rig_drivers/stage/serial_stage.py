"""A linear stage behind a serial controller: everything that does not depend on the protocol."""

import threading
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from rig.devices import Clock
from rig.errors import (
    ConfigError,
    DeviceError,
    DeviceLostError,
    StageAlarmError,
    StageTimeoutError,
    every_advice,
)
from rig.profile import SerialStageConfig
from rig_drivers.stage.controller import Controller
from rig_drivers.stage.serial_line import SerialLine
from rig_drivers.stage.travel import check_inside, check_reached, distance_mm, machine_mm

READING_TIMEOUT_S = 3.0
"""Longest wait for the position of a stage that should stand."""
SOONEST = 0.9
"""Part of the way's time at full speed before which no move can have ended."""


def serial_line(config: SerialStageConfig, clock: Clock, name: str) -> SerialLine:
    """Return the line of a profile's stage, not yet opened."""
    return SerialLine(
        config.port, config.baud, clock=clock, device=name, dtr=config.dtr, rts=config.rts
    )


class SerialStage:
    """Keeps `rig.devices.Stage`.

    A position is approached from the near side over `approach_mm`: going farther by more than that
    goes straight, anything else goes too near first and comes back, so that backlash always lies
    on the same side. A move has ended when the controller has proved it and two readings agree that
    the axis stands where it was sent. On every way out of a call that moves, the stage stands.
    """

    def __init__(
        self,
        config: SerialStageConfig,
        line: SerialLine,
        controller: Controller,
        clock: Clock,
        name: str,
    ) -> None:
        self._config = config
        self._line = line
        self._controller = controller
        self._clock = clock
        self._name = name
        self._lock = threading.RLock()
        self._about: Mapping[str, str] = {}
        self._may_be_moving = False

    # -- opening and closing ------------------------------------------------------------------

    def __enter__(self) -> Self:
        """Open the port; where that resets the controller the position is unknown until homed.

        Raises:
            DeviceNotFoundError: no such port, or another protocol behind it.
            ConfigError: the controller's settings do not allow what the profile asks for.
        """
        with self._lock:
            self._line.open()
            try:
                self._may_be_moving = False
                self._about = self._controller.connect()
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
                if not isinstance(error, DeviceLostError):
                    if self._may_be_moving:
                        self._halt()
                    if self._config.motor_off_at_end:
                        self._controller.begin()
                        self._controller.motor_off()
            finally:
                self._line.close()

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {"kind": self._config.kind, "port": self._config.port, **self._about}

    # -- Stage --------------------------------------------------------------------------------

    @property
    def travel_mm(self) -> tuple[float, float]:
        """See `Stage.travel_mm`."""
        return self._config.travel_mm

    @property
    def position_mm(self) -> float:
        """See `Stage.position_mm`."""
        with self._lock:
            self._controller.begin()
            return self._read_position("asked for the position", READING_TIMEOUT_S)

    def home(self) -> None:
        """See `Stage.home`.

        Raises:
            ConfigError: the profile forbids moving.
        """
        self._check_may_move("asked to home")
        timeout_s = self._config.homing_timeout_s
        with self._lock:
            self._controller.begin()
            try:
                self._may_be_moving = True
                home_mm = distance_mm(self._config, self._controller.home(timeout_s))
                reached_mm = self._rest("asked to home", timeout_s)
                check_reached(self._config, home_mm, reached_mm, device=self._name)
            except BaseException as error:
                self._halt_after(error)
                raise
            self._controller.trust()
            self._may_be_moving = False

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        """See `Stage.move_to`.

        Raises:
            ConfigError: the profile forbids moving.
        """
        check_inside(self._config.travel_mm, position_mm, device=self._name)
        what = f"asked for {position_mm:.3f} mm within {timeout_s:.1f} s"
        self._check_may_move(what)
        with self._lock:
            self._controller.begin()
            deadline_s = self._clock.now_s() + timeout_s
            try:
                here_mm = self._read_position("before the move", READING_TIMEOUT_S)
                before_mm = position_mm - self._config.approach_mm
                if here_mm > before_mm:
                    here_mm = self._go(here_mm, before_mm, deadline_s, what)
                return self._go(here_mm, position_mm, deadline_s, what)
            except BaseException as error:
                self._halt_after(error)
                raise

    def stop(self) -> None:
        """See `Stage.stop`; may be called from another thread or a signal handler in a move.

        The call that moves then ends with StageAlarmError, code "stopped".

        Raises:
            DeviceLostError: the controller did not confirm that it stands.
        """
        if not self._line.is_open:
            return
        try:
            self._controller.cancel()
            with self._lock:
                if self._line.is_open:
                    self._halt()
        finally:
            self._controller.resume()

    # -- moving -------------------------------------------------------------------------------

    def _go(self, here_mm: float, wanted_mm: float, deadline_s: float, what: str) -> float:
        """Make one straight motion and prove its end."""
        self._may_be_moving = True
        start_s = self._clock.now_s()
        self._controller.move(machine_mm(self._config, wanted_mm))
        self._read_position(what, max(0.0, deadline_s - self._clock.now_s()))
        self._controller.confirm_end()
        reached_mm = self._read_position(what, READING_TIMEOUT_S)
        check_reached(self._config, wanted_mm, reached_mm, device=self._name)
        self._check_not_too_early(abs(reached_mm - here_mm), self._clock.now_s() - start_s, what)
        self._may_be_moving = False
        return reached_mm

    def _check_not_too_early(self, way_mm: float, took_s: float, what: str) -> None:
        """See that the way was possible in this time: a controller may claim what is not so."""
        least_s = SOONEST * way_mm / self._config.speed_mm_s
        if took_s < least_s:
            raise StageAlarmError(
                self._name,
                f"{what}, the controller claims {way_mm:.3f} mm after {took_s:.2f} s, at "
                f"{self._config.speed_mm_s:.1f} mm/s that takes at least {least_s:.2f} s",
                advice="see whether the carriage moves at all, then home again",
                code="too early",
            )

    def _read_position(self, what: str, timeout_s: float) -> float:
        """Return the distance at which the homed stage comes to rest."""
        if not self._controller.is_homed:
            raise StageAlarmError(
                self._name,
                "the position is not known",
                advice="home the stage first",
                code="not homed",
            )
        return self._rest(what, timeout_s)

    def _rest(self, what: str, timeout_s: float) -> float:
        rest_mm = self._controller.rest_mm(what, timeout_s)
        if rest_mm is None:
            raise StageTimeoutError(
                self._name,
                f"{what}, still not at rest after {timeout_s:.1f} s, stopped",
                advice="allow more time, raise the speed, or check the reference switch",
                timeout_s=timeout_s,
            )
        return distance_mm(self._config, rest_mm)

    def _check_may_move(self, what: str) -> None:
        if not self._config.may_move:
            raise ConfigError(
                f"{self._name}: {what}, stage.may_move is false",
                advice="clear the way of the carriage and set it to true",
            )

    # -- stopping -----------------------------------------------------------------------------

    def _halt_after(self, error: BaseException) -> None:
        """Stop because of an error, if the stage may be moving."""
        if not self._may_be_moving:
            return
        try:
            self._halt()
        except DeviceError as failed:
            known = isinstance(error, DeviceError)
            raise DeviceLostError(
                self._name,
                f"{error.symptom if known else str(error) or type(error).__name__}; "
                f"could not be stopped: {failed.symptom}",
                advice=every_advice([error, failed] if known else [failed]),
            ) from error

    def _halt(self) -> None:
        self._controller.halt()
        self._may_be_moving = False
