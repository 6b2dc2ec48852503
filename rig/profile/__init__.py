"""Profiles: what a rig consists of, as closed and documented values."""

from rig.profile.cameras import (
    CameraConfig,
    FolderCameraConfig,
    OakCameraConfig,
    SimCameraConfig,
    V4l2CameraConfig,
)
from rig.profile.models import Profile, SweepConfig, TargetConfig, ViewConfig
from rig.profile.stages import (
    GrblStageConfig,
    SerialStageConfig,
    StageConfig,
)
from rig.profile.world import CarriageConfig, FirmwareConfig, WorldConfig

__all__ = [
    "CameraConfig",
    "CarriageConfig",
    "FirmwareConfig",
    "FolderCameraConfig",
    "GrblStageConfig",
    "OakCameraConfig",
    "Profile",
    "SerialStageConfig",
    "SimCameraConfig",
    "StageConfig",
    "SweepConfig",
    "TargetConfig",
    "V4l2CameraConfig",
    "ViewConfig",
    "WorldConfig",
]
