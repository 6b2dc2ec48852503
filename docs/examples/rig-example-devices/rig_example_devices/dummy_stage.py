"""The stage: keeps `rig.devices.Stage`."""

import threading
from collections.abc import Mapping
from typing import Self

from rig.devices import Clock
from rig.errors import ConfigError, StageAlarmError, StageLimitError, StageTimeoutError
from rig_example_devices.kind import DummyStageConfig

_NAME = "stage dummy"
_STEP_S = 0.01


class DummyStage:
    """Goes at its speed from place to place, on the clock that it is given."""

    def __init__(self, config: DummyStageConfig, clock: Clock) -> None:
        self._config, self._clock = config, clock
        self._at_mm: float | None = None
        self._stop = threading.Event()

    def __enter__(self) -> Self:
        self._at_mm = None
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._at_mm = None

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {"kind": "dummy", "model": "counts only", "serial": "dummy-1"}

    @property
    def travel_mm(self) -> tuple[float, float]:
        """See `Stage.travel_mm`."""
        return self._config.travel_mm

    @property
    def position_mm(self) -> float:
        """See `Stage.position_mm`."""
        if self._at_mm is None:
            raise StageAlarmError(
                _NAME, "the position is not known; home the stage first", code="not homed"
            )
        return self._at_mm

    def home(self) -> None:
        """See `Stage.home`."""
        if not self._config.may_move:
            raise ConfigError(f"{_NAME}: asked to home, stage.may_move is false; set it to true")
        self._at_mm = self.travel_mm[0]

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        """See `Stage.move_to`."""
        here_mm = self.position_mm
        near_mm, far_mm = self.travel_mm
        if not near_mm <= position_mm <= far_mm:
            raise StageLimitError(_NAME, wanted_mm=position_mm, travel_mm=self.travel_mm)
        self._stop.clear()
        began_s, way_mm = self._clock.now_s(), position_mm - here_mm
        takes_s = abs(way_mm) / self._config.speed_mm_s
        while (passed_s := self._clock.now_s() - began_s) < takes_s:
            self._at_mm = here_mm + way_mm * passed_s / takes_s
            if self._stop.is_set():
                raise StageAlarmError(_NAME, "stopped; move again", code="stopped")
            if passed_s >= timeout_s:
                raise StageTimeoutError(
                    _NAME, f"not at rest after {timeout_s} s, stopped", timeout_s=timeout_s
                )
            self._clock.sleep_s(_STEP_S)
        self._at_mm = position_mm
        return self.position_mm

    def stop(self) -> None:
        """See `Stage.stop`."""
        self._stop.set()
