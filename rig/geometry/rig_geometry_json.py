"""A rig's geometry as JSON: versioned, closed, and equal to the last digit when it comes back."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rig.arrays import Float
from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry, StageGeometry
from rig.json_codec import Codec

VERSION = 1
"""Of the JSON; a reader refuses any other."""


@dataclass(frozen=True, slots=True)
class _StoredGeometry:
    """The fields of the JSON."""

    version: int
    names: tuple[str, ...]
    reference: int
    cameras: tuple[CameraModel, ...]
    poses: tuple[Pose, ...]
    covariance: Float | None
    stage: StageGeometry | None


_JSON = Codec(_StoredGeometry, name="geometry", error=ConfigError, advice="calibrate again")


def geometry_to_json(geometry: RigGeometry) -> dict[str, Any]:
    """Return a plain dict of numbers, strings and lists; `geometry_from_json` takes it back."""
    return _JSON.to_json(
        _StoredGeometry(
            version=VERSION,
            names=geometry.names,
            reference=geometry.reference,
            cameras=geometry.cameras,
            poses=geometry.cam_from_reference,
            covariance=geometry.covariance,
            stage=geometry.stage,
        )
    )


def geometry_from_json(content: Mapping[str, Any]) -> RigGeometry:
    """Build the geometry that `geometry_to_json` wrote.

    Raises:
        ConfigError: another version, unknown or missing names, or numbers that make no rig.
    """
    version = content.get("version")
    if version != VERSION:
        raise ConfigError(
            f"a stored calibration has version {version!r}, this program reads {VERSION}",
            advice="calibrate again, or use the version of rig that wrote it",
        )
    stored = _JSON.from_json(dict(content))
    return RigGeometry(
        names=stored.names,
        reference=stored.reference,
        cameras=stored.cameras,
        cam_from_reference=stored.poses,
        covariance=stored.covariance,
        stage=stored.stage,
    )
