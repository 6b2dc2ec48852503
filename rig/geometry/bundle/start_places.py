"""First guess of where the views and the boards are, chained through shared pictures."""

from collections.abc import Mapping, Sequence

import numpy as np

from rig.geometry.bundle.start_cameras import BoardPoints, board_misfit, board_pose
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose

BoardsByPictureAndView = Mapping[tuple[int, int], BoardPoints]
"""Boards by (picture, view)."""


def poses_in_views(
    boards: BoardsByPictureAndView, cameras: Sequence[CameraModel]
) -> dict[tuple[int, int], Pose]:
    """cam_from_board of every board that its view can show, by (picture, view)."""
    poses = {key: board_pose(cameras[key[1]], board) for key, board in boards.items()}
    return {key: pose for key, pose in poses.items() if pose is not None}


def place_views(
    poses: Mapping[tuple[int, int], Pose], tree: Sequence[tuple[int, int]], view_count: int
) -> list[Pose]:
    """cam_from_reference of every view, along the edges of a spanning tree.

    Every picture that both views share gives a relative pose; the one nearest to all others is
    taken, so that a few wrong pictures do not matter.
    """
    places = [Pose.identity()] * view_count
    for known, new in tree:
        pictures = sorted({p for p, v in poses if v == known} & {p for p, v in poses if v == new})
        relative = [poses[p, new] @ poses[p, known].inverse() for p in pictures]
        depth = [float(np.linalg.norm(poses[p, known].translation_mm)) for p in pictures]
        places[new] = _middle(relative, float(np.median(depth))) @ places[known]
    return places


def _middle(poses: Sequence[Pose], length_mm: float) -> Pose:
    """Return the pose nearest to all others; shifts count against a length, turns in rad."""
    turn = np.stack([pose.rotation for pose in poses])
    shift = np.stack([pose.translation_mm for pose in poses]) / length_mm
    apart = np.linalg.norm(shift[:, None] - shift, axis=2)
    apart += np.linalg.norm(turn[:, None] - turn, axis=(2, 3)) / np.sqrt(2.0)
    return poses[int(np.argmin(apart.sum(axis=1)))]


def place_boards(
    boards: BoardsByPictureAndView,
    poses: Mapping[tuple[int, int], Pose],
    cameras: Sequence[CameraModel],
    places: Sequence[Pose],
) -> dict[int, Pose]:
    """reference_from_board by picture: of all views' answers the one that fits all views best."""
    best: dict[int, Pose] = {}
    for picture in sorted({picture for picture, _ in poses}):
        views = [view for shown, view in poses if shown == picture]
        guesses = [places[view].inverse() @ poses[picture, view] for view in views]
        misfits = [
            sum(
                min(
                    board_misfit(cameras[v], boards[picture, v], places[v] @ guess),
                    cameras[v].width_px,
                )
                for v in views
            )
            for guess in guesses
        ]
        best[picture] = guesses[int(np.argmin(misfits))]
    return best
