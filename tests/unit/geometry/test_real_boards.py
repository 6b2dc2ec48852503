"""Corners in real pictures of a hand-held 9 x 6 board; 25 stereo pairs, 640 x 512."""

import cv2
import numpy as np
import pytest

from rig.geometry.homography import fit_homography, map_points
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import Corners, find_corners
from tests.support.shared_data import SHARED

BOARD = Checkerboard(9, 6, 25.0)
FOLDER = SHARED / "checkerboard-stereo"

pytestmark = pytest.mark.skipif(
    not FOLDER.is_dir(), reason=f"no pictures in {FOLDER}; set RIG_SHARED_DATA"
)


def corners_in(name: str) -> Corners:
    grey = cv2.imread(str(FOLDER / name), cv2.IMREAD_GRAYSCALE)
    return find_corners(np.asarray(grey, np.uint8), BOARD)


def flatness_px(corners: Corners, side: str) -> float:
    """Rms distance of the undistorted corners from a flat board."""
    file = cv2.FileStorage(str(FOLDER / "intrinsics.yml"), cv2.FILE_STORAGE_READ)
    camera, distortion = (file.getNode(name + side).mat() for name in "MD")
    places = BOARD.points_mm.reshape(-1, 3)[:, :2]
    ideal = cv2.undistortPoints(corners.xy_px.reshape(-1, 1, 2), camera, distortion, P=camera)
    xy_px = np.asarray(ideal, np.float64).reshape(-1, 2)
    apart = map_points(fit_homography(places, xy_px), places) - xy_px
    return float(np.sqrt(np.mean(apart**2)))


@pytest.mark.parametrize("number", [3, 12, 18, 25])
def test_both_views_are_found_in_one_order_and_flat(number: int):
    left, right = (corners_in(f"{side}{number:02}.jpg") for side in ("left", "right"))
    # Cameras side by side: the same order means that all corners move alike.
    assert np.ptp(left.xy_px - right.xy_px, axis=(0, 1)).max() < left.side_px
    assert flatness_px(left, "1") < 0.15
    assert flatness_px(right, "2") < 0.15


@pytest.mark.slow
def test_all_fifty_are_found():
    names = sorted(file.name for file in FOLDER.glob("*.jpg"))
    assert len(names) == 50
    for name in names:
        corners_in(name)
