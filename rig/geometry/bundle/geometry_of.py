"""Between the unknowns of the solve and the geometry of a rig, covariance included."""

from collections.abc import Sequence

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.linearise import Target
from rig.geometry.bundle.rotations import rodrigues_by_turn
from rig.geometry.bundle.unknowns import Layout, StageLine, Unknowns
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry, StageGeometry


def unknowns_of(geometry: RigGeometry, boards: Sequence[Pose]) -> Unknowns:
    """Cameras and places of a geometry, a flat board and the poses of boards in its frame."""
    places = geometry.cam_from_reference
    return Unknowns(
        lenses=tuple(camera.lens for camera in geometry.cameras),
        intrinsics=tuple(
            np.array([c.fx_px, c.fy_px, c.cx_px, c.cy_px, *c.coefficients])
            for c in geometry.cameras
        ),
        view_rotation=np.stack([place.rotation for place in places]),
        view_shift_mm=np.stack([place.translation_mm for place in places]),
        warp_mm=np.zeros(3),
        board_rotation=np.stack([pose.rotation for pose in boards]),
        board_shift_mm=np.stack([pose.translation_mm for pose in boards]),
    )


def cameras_of(at: Unknowns, sizes_px: Sequence[tuple[int, int]]) -> tuple[CameraModel, ...]:
    """Return one camera per view."""
    return tuple(
        CameraModel(size[0], size[1], *_four(numbers), lens, tuple(map(float, numbers[4:])))
        for size, lens, numbers in zip(sizes_px, at.lenses, at.intrinsics, strict=True)
    )


def _four(numbers: Float) -> tuple[float, float, float, float]:
    fx, fy, cx, cy = map(float, numbers[:4])
    return fx, fy, cx, cy


def places_of(at: Unknowns) -> tuple[Pose, ...]:
    """cam_from_reference of every view."""
    return tuple(map(Pose, at.view_rotation, at.view_shift_mm))


def boards_of(at: Unknowns) -> tuple[Pose, ...]:
    """reference_from_board of every picture."""
    return tuple(map(Pose, at.board_rotation, at.board_shift_mm))


def rodrigues_by_shared(geometry: RigGeometry) -> Float:
    """(P, P) from turns and shifts of the views to the numbers that `RigGeometry` is told in."""
    jacobian = np.eye(geometry.parameter_count)
    at = geometry.parameter_count - 6 * (len(geometry.names) - 1)
    for view, place in enumerate(geometry.cam_from_reference):
        if view != geometry.reference:
            jacobian[at : at + 3, at : at + 3] = rodrigues_by_turn(place.rotation_rad)
            at += 6
    return jacobian


def stage_geometry(
    line: StageLine, target: Target, layout: Layout, covariance: Float
) -> StageGeometry:
    """Express the stage about the board's middle and driver position 0, with covariance.

    Args:
        line: the stage.
        target: the board it carries.
        layout: of the shared unknowns, stage included.
        covariance: (P, P) of the shared unknowns.
    """
    middle = line.rotation @ [*target.centre_mm, 0.0]
    depth_mm = line.origin_mm[2] + middle[2] - line.scale * line.middle_mm * line.axis[2]
    jacobian = np.zeros((4, 9))
    jacobian[:2, 6:8] = line.across[:, :2].T
    jacobian[2, 8] = 1.0
    jacobian[3, :3] = middle[1], -middle[0], 0.0
    jacobian[3, 5] = 1.0
    jacobian[3, 6:8] = -line.scale * line.middle_mm * line.across[:, 2]
    jacobian[3, 8] = -line.middle_mm * line.axis[2]
    own = covariance[np.ix_(layout.stage_columns, layout.stage_columns)]
    return StageGeometry(
        axis=line.axis,
        scale=line.scale,
        zero_mm=float(depth_mm),
        covariance=jacobian @ own @ jacobian.T,
    )
