"""Profiles: what a rig consists of, as closed and documented values."""

from rig.profile.cameras import (
    CameraConfig,
    FolderCameraConfig,
    NoiseConfig,
    RecordingCameraConfig,
    SimCameraConfig,
)
from rig.profile.intrinsics import IntrinsicsConfig
from rig.profile.lenslet_camera import RAW_VIEW, LensletCameraConfig
from rig.profile.lenslet_world import LensletWorldConfig
from rig.profile.models import Profile, SweepConfig
from rig.profile.oak_cameras import OakCameraConfig, OakPixels, OakSensorConfig
from rig.profile.parts import PartConfig, Region, regions_in
from rig.profile.scan_camera import ScanCameraConfig
from rig.profile.stages import (
    CommandStageConfig,
    GrblStageConfig,
    ManualStageConfig,
    MarlinStageConfig,
    SerialStageConfig,
    StageConfig,
    ZaberStageConfig,
)
from rig.profile.targets import (
    AprilGridConfig,
    AsymmetricCirclesConfig,
    CharucoConfig,
    CheckerboardConfig,
    SquaresConfig,
    TargetConfig,
)
from rig.profile.v4l2_cameras import V4l2CameraConfig
from rig.profile.views import ViewConfig
from rig.profile.world import (
    CarriageConfig,
    FirmwareConfig,
    MarlinFirmwareConfig,
    WorldConfig,
    ZaberFirmwareConfig,
)

__all__ = [
    "RAW_VIEW",
    "AprilGridConfig",
    "AsymmetricCirclesConfig",
    "CameraConfig",
    "CarriageConfig",
    "CharucoConfig",
    "CheckerboardConfig",
    "CommandStageConfig",
    "FirmwareConfig",
    "FolderCameraConfig",
    "GrblStageConfig",
    "IntrinsicsConfig",
    "LensletCameraConfig",
    "LensletWorldConfig",
    "ManualStageConfig",
    "MarlinFirmwareConfig",
    "MarlinStageConfig",
    "NoiseConfig",
    "OakCameraConfig",
    "OakPixels",
    "OakSensorConfig",
    "PartConfig",
    "Profile",
    "RecordingCameraConfig",
    "Region",
    "ScanCameraConfig",
    "SerialStageConfig",
    "SimCameraConfig",
    "SquaresConfig",
    "StageConfig",
    "SweepConfig",
    "TargetConfig",
    "V4l2CameraConfig",
    "ViewConfig",
    "WorldConfig",
    "ZaberFirmwareConfig",
    "ZaberStageConfig",
    "regions_in",
]
