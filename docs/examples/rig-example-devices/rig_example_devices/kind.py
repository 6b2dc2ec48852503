"""What rig has to know of both kinds; nothing here imports a driver before it is opened."""

from typing import Literal

from pydantic import Field

from rig.devices import Camera, Stage
from rig.discovery import FoundDevice, Search
from rig.profile import CameraConfig, StageConfig
from rig.profile.kinds import (
    CameraKind,
    CameraTemplate,
    NewCamera,
    NewStage,
    StageKind,
    StageTemplate,
    Surroundings,
)


class PatternCameraConfig(CameraConfig):
    """A camera that draws dots on a wall, the same for every view but for their slope."""

    kind: Literal["pattern"]
    """Selects the drawn pattern."""
    width_px: int = Field(default=320, ge=16)
    """Image width."""
    height_px: int = Field(default=240, ge=16)
    """Image height."""
    slope_px: float = 2.0
    """How far the dots move from view to view, px per view step."""
    exposure_s: float = Field(default=0.005, gt=0.0)
    """Exposure time."""


class DummyStageConfig(StageConfig):
    """A stage that only counts."""

    kind: Literal["dummy"]
    """Selects the dummy."""


def _open_camera(config: PatternCameraConfig, around: Surroundings) -> Camera:
    from rig_example_devices.pattern_camera import PatternCamera

    return PatternCamera(config, around.views, around.clock)


def _open_stage(config: DummyStageConfig, around: Surroundings) -> Stage:
    from rig_example_devices.dummy_stage import DummyStage

    return DummyStage(config, around.clock)


def _find(timeout_s: float) -> list[FoundDevice]:
    """A real search asks the system, and takes no longer than `timeout_s`."""
    return [FoundDevice("pattern-1", "draws dots; always there")]


def _camera_section(new: NewCamera) -> str:
    return f'[camera]\nkind = "pattern"  # found: {", ".join(new.devices) or "none"}\n'


def _stage_section(new: NewStage) -> str:
    return (
        '[stage]\nkind = "dummy"\n'
        f"travel_mm = [{new.near_mm}, {new.far_mm}]  # MEASURE\n"
        "may_move = false  # true when the way is clear\n"
    )


PATTERN = CameraKind(
    contract=1,
    name="pattern",
    config=PatternCameraConfig,
    open=_open_camera,
    search=Search("pattern", "camera.kind", _find, "drawn patterns"),
    template=CameraTemplate("drawn views", _camera_section, views=2),
)
DUMMY = StageKind(
    contract=1,
    name="dummy",
    config=DummyStageConfig,
    open=_open_stage,
    template=StageTemplate(_stage_section),
)
