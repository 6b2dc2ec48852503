"""The stage that is a person: says where, waits, and takes what the person says for the place."""

import math
import re
import threading
from collections.abc import Mapping
from typing import Self

from rig.devices import Clock
from rig.errors import (
    ConfigError,
    DeviceLostError,
    StageAlarmError,
    StageTimeoutError,
)
from rig.profile import ManualStageConfig
from rig_drivers.manual.terminal import Person
from rig_drivers.stage.travel import check_inside

SLICE_S = 0.2
"""Longest wait before somebody who wants to stop is heard."""
_READING = re.compile(r"\d{1,6}(?:[.,]\d{1,4})?(?: ?mm)?", re.ASCII)


def read_mm(typed: str) -> float | None:
    """Return the distance that somebody typed, with a point or a comma; None if it is none."""
    if not _READING.fullmatch(typed):
        return None
    return float(typed.removesuffix("mm").strip().replace(",", "."))


class ManualStage:
    """Keeps `rig.devices.Stage`, as far as a hand can.

    The position is what the person has said last, for nothing reads it back. Whoever stops a move
    leaves the board somewhere between, so that it must be put at its beginning again.
    """

    def __init__(
        self, config: ManualStageConfig, clock: Clock, person: Person, *, name: str = "stage"
    ) -> None:
        self._config = config
        self._clock = clock
        self._person = person
        self._name = name
        self._lock = threading.RLock()
        self._stops = 0
        self._is_open = False
        self._at_mm: float | None = None

    def __enter__(self) -> Self:
        """See that there is a person.

        Raises:
            DeviceNotFoundError: there is no terminal.
        """
        self._person.greet()
        self._at_mm = None
        self._is_open = True
        return self

    def __exit__(self, *_: object) -> None:
        """Ask for nothing any more."""
        self.stop()
        self._is_open = False

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        sigma_mm = self._config.reading_sigma_mm
        return {"kind": self._config.kind, "reading": f"1 sigma {sigma_mm:g} mm"}

    @property
    def travel_mm(self) -> tuple[float, float]:
        """See `Stage.travel_mm`."""
        return self._config.travel_mm

    @property
    def position_mm(self) -> float:
        """See `Stage.position_mm`; what the person has said last."""
        self._check_open()
        if self._at_mm is None:
            raise StageAlarmError(
                self._name,
                "the position is not known",
                advice="home the stage first: put the board at its nearest distance",
                code="not homed",
            )
        return self._at_mm

    def home(self) -> None:
        """See `Stage.home`: the board is put at its nearest distance.

        Raises:
            ConfigError: the profile forbids moving.
        """
        self._check_open()
        self._check_may_move("asked to home")
        near_mm = self._config.travel_mm[0]
        with self._lock:
            self._at_mm = None
            self._at_mm = self._put(near_mm, self._config.patience_s)

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        """See `Stage.move_to`; a person has at least the profile's `patience_s`.

        Raises:
            ConfigError: the profile forbids moving.
        """
        check_inside(self._config.travel_mm, position_mm, device=self._name)
        self._check_may_move(f"asked for {position_mm:.1f} mm")
        with self._lock:
            if self.position_mm == position_mm:
                return position_mm
            self._at_mm = None
            self._at_mm = self._put(position_mm, max(timeout_s, self._config.patience_s))
            return self._at_mm

    def stop(self) -> None:
        """See `Stage.stop`: whoever waits for the person gives up."""
        self._stops += 1
        with self._lock:
            return  # whoever waited has given up now

    def _put(self, wanted_mm: float, patience_s: float) -> float:
        """Ask until the board stands there; returns where it does."""
        tolerance_mm = self._config.tolerance_mm
        self._person.tell(
            f"Put the board at {wanted_mm:.1f} mm and press Enter (or type the distance that it "
            "has, mm)."
        )
        begun_at, deadline_s = self._stops, self._clock.now_s() + patience_s
        while (typed := self._listen(deadline_s, begun_at)) is not None:
            reading_mm = wanted_mm if not typed else read_mm(typed)
            if reading_mm is None:
                self._person.tell(f"{typed!r} is no distance in mm; Enter alone: it stands there.")
            elif math.isclose(reading_mm, wanted_mm, rel_tol=0.0, abs_tol=tolerance_mm):
                return reading_mm
            else:
                self._person.tell(
                    f"{reading_mm:.1f} mm is more than {tolerance_mm:.1f} mm away from "
                    f"{wanted_mm:.1f} mm: put it nearer to that (stage.tolerance_mm)."
                )
        raise StageTimeoutError(
            self._name,
            f"asked for {wanted_mm:.1f} mm, nobody pressed Enter within {patience_s:.0f} s",
            advice="resume when somebody is there, or raise stage.patience_s",
            timeout_s=patience_s,
        )

    def _listen(self, deadline_s: float, begun_at: int) -> str | None:
        while True:
            left_s = deadline_s - self._clock.now_s()
            typed = self._person.answer(min(SLICE_S, max(0.0, left_s)))
            if self._stops != begun_at:
                raise StageAlarmError(
                    self._name,
                    "stopped on request",
                    advice="home again: nobody knows where the board is now",
                    code="stopped",
                )
            if typed is not None or left_s <= 0.0:
                return typed

    def _check_open(self) -> None:
        if not self._is_open:
            raise DeviceLostError(self._name, "is not open", advice="use it inside `with`")

    def _check_may_move(self, what: str) -> None:
        if not self._config.may_move:
            raise ConfigError(
                f"{self._name}: {what}, stage.may_move is false",
                advice="set it to true when the lines of [stage] are measured",
            )
