"""Cameras that were placed in a frame of their own, as a rig seen from one of them."""

from collections.abc import Sequence

import numpy as np

from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_AT_ORIGIN = 1e-9


def seen_from_one(
    names: Sequence[str], cameras: Sequence[CameraModel], cam_from_world: Sequence[Pose]
) -> RigGeometry:
    """Return the rig of some placed cameras.

    Args:
        names: of the views.
        cameras: one per view.
        cam_from_world: one per view, from any frame that they share.

    Returns:
        The geometry whose reference is the first camera that stands in the origin of that frame,
        unturned, else the first.
    """
    reference = next((i for i, pose in enumerate(cam_from_world) if _is_identity(pose)), 0)
    world_from_reference = cam_from_world[reference].inverse()
    return RigGeometry(
        tuple(names),
        reference,
        tuple(cameras),
        tuple(
            Pose.identity() if i == reference else pose @ world_from_reference
            for i, pose in enumerate(cam_from_world)
        ),
    )


def _is_identity(pose: Pose) -> bool:
    moved = float(np.abs(pose.translation_mm).max())
    return max(moved, float(np.abs(pose.rotation - np.eye(3)).max())) < _AT_ORIGIN
