"""The first guess of everything, from the sightings or from a geometry at hand."""

from collections.abc import Sequence

import numpy as np

from rig.errors import CalibrationError
from rig.geometry.bundle.linearise import Target
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.start_cameras import BoardPoints, CameraStart, guess_camera
from rig.geometry.bundle.start_places import place_boards, place_views, poses_in_views
from rig.geometry.bundle.unknowns import Unknowns
from rig.geometry.bundle.view_graph import shared_pictures, spanning_tree
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

FEWEST_BOARDS = 3
"""Boards in a view below which its intrinsics cannot be told."""


def guess(
    observed: Observations,
    target: Target,
    sizes_px: Sequence[tuple[int, int]],
    names: Sequence[str],
    reference: int,
    lens: LensModel | None,
) -> Unknowns:
    """Guess cameras, then their places, then the boards.

    Args:
        observed: what was found.
        target: the board.
        sizes_px: (width, height) of each view.
        names: of each view.
        reference: index of the reference view.
        lens: model to start with; None tries a pinhole and a fisheye and takes what fits.

    Raises:
        CalibrationError: a view with too few boards, or no chain from the reference to it.
    """
    boards = _boards(observed, target)
    tree = spanning_tree(shared_pictures(observed, len(names)), reference, names)
    for view, name in enumerate(names):
        count = int((observed.view == view).sum())
        if count < FEWEST_BOARDS:
            raise CalibrationError(
                f"view {name} shows the board in {count} pictures, at least {FEWEST_BOARDS} are "
                "needed",
                advice="take more, tilted to all sides",
            )
    of_view = [
        [board for (_, v), board in boards.items() if v == view] for view in range(len(names))
    ]
    tried: list[LensModel] = [lens] if lens else ["brown5", "fisheye"]
    guesses = [
        [guess_camera(own, size, model) for own, size in zip(of_view, sizes_px, strict=True)]
        for model in tried
    ]
    best = min(guesses, key=_misfit)
    cameras = [start.camera for start in best]
    poses = poses_in_views(boards, cameras)
    places = place_views(poses, tree, len(names))
    return _unknowns(observed, cameras, places, place_boards(boards, poses, cameras, places))


def start_from(observed: Observations, target: Target, geometry: RigGeometry) -> Unknowns:
    """Take cameras and places from a geometry, and guess the boards."""
    boards = _boards(observed, target)
    cameras, places = geometry.cameras, geometry.cam_from_reference
    poses = poses_in_views(boards, cameras)
    return _unknowns(observed, cameras, places, place_boards(boards, poses, cameras, places))


def _misfit(starts: Sequence[CameraStart]) -> float:
    return sum(start.misfit_px for start in starts)


def _boards(observed: Observations, target: Target) -> dict[tuple[int, int], BoardPoints]:
    plane = target.points_mm[:, :2]
    return {
        (int(picture), int(view)): BoardPoints(plane[observed.ids[rows]], observed.xy_px[rows])
        for picture, view, rows in (
            (observed.picture[s], observed.view[s], observed.points(s))
            for s in range(len(observed.view))
        )
    }


def _unknowns(
    observed: Observations,
    cameras: Sequence[CameraModel],
    places: Sequence[Pose],
    boards: dict[int, Pose],
) -> Unknowns:
    lost = [n for index, n in enumerate(observed.pictures) if index not in boards]
    if lost:
        raise CalibrationError(
            f"no pose of the board fits pictures {', '.join(map(str, lost))}",
            advice="leave them out",
        )
    ordered = [boards[index] for index in range(len(observed.pictures))]
    return Unknowns(
        lenses=tuple(camera.lens for camera in cameras),
        intrinsics=tuple(
            np.array([c.fx_px, c.fy_px, c.cx_px, c.cy_px, *c.coefficients]) for c in cameras
        ),
        view_rotation=np.stack([place.rotation for place in places]),
        view_shift_mm=np.stack([place.translation_mm for place in places]),
        warp_mm=np.zeros(3),
        board_rotation=np.stack([pose.rotation for pose in ordered]),
        board_shift_mm=np.stack([pose.translation_mm for pose in ordered]),
    )
