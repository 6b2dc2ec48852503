"""Devices for the suites: `pytest --pyargs rig.testing -p rig_example_devices.testing`."""

import pytest

from rig.devices import SystemClock
from rig.profile import ViewConfig
from rig.testing import CameraCase, StageCase
from rig_example_devices.dummy_stage import DummyStage
from rig_example_devices.kind import DummyStageConfig, PatternCameraConfig
from rig_example_devices.pattern_camera import PatternCamera


class QuickClock:
    """Time that passes when somebody sleeps: nobody has to wait for a long move."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def now_s(self) -> float:
        """See `rig.devices.Clock.now_s`."""
        return self._now_s

    def sleep_s(self, duration_s: float) -> None:
        """See `rig.devices.Clock.sleep_s`."""
        self._now_s += max(0.0, duration_s)


@pytest.fixture
def camera_case() -> CameraCase:
    """The camera with two views, in real time."""
    views = [ViewConfig(name=name, x_steps=x, y_steps=0.0) for name, x in (("a", 0.0), ("b", 1.0))]
    clock = SystemClock()
    return CameraCase(PatternCamera(PatternCameraConfig(kind="pattern"), views, clock), clock)


@pytest.fixture
def stage_case() -> StageCase:
    """The stage in quick time."""
    clock = QuickClock()
    config = DummyStageConfig(kind="dummy", travel_mm=(400.0, 1200.0))
    return StageCase(DummyStage(config, clock), clock, tolerance_mm=0.001)
