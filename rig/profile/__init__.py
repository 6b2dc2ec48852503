"""Profiles: what a rig consists of, as closed and documented values."""

from rig.profile.models import (
    CameraConfig,
    FolderCameraConfig,
    GrblStageConfig,
    Profile,
    SimCameraConfig,
    SweepConfig,
    TargetConfig,
    ViewConfig,
)
from rig.profile.world import CarriageConfig, FirmwareConfig, WorldConfig

__all__ = [
    "CameraConfig",
    "CarriageConfig",
    "FirmwareConfig",
    "FolderCameraConfig",
    "GrblStageConfig",
    "Profile",
    "SimCameraConfig",
    "SweepConfig",
    "TargetConfig",
    "ViewConfig",
    "WorldConfig",
]
