"""The joint line fit of a board, against closed-form truth."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews
from rig.epipolar.board_fit import fit_board_slope
from rig.errors import TargetError
from rig.geometry.board import Board
from rig.geometry.corners import Corners, find_corners
from tests.support.board_images import BoardScene, digitised

BOARD = Board(9, 6, 25.0)
X_STEPS = np.array([0.0, -1.1, 0.93, 0.0, 0.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -1.05, 0.96])
GAINS = (1.0, 1.02, 0.98, 1.01, 0.97)


def pictures(
    scene: BoardScene, *, noise: float, seed: int = 0, gains: tuple[float, ...] = GAINS
) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    return np.stack(
        [
            digitised(scene.clean(x, y), noise=noise, rng=rng, gain=gain)
            for x, y, gain in zip(X_STEPS, Y_STEPS, gains, strict=True)
        ]
    )


def board_views(images: NDArray[np.generic]) -> tuple[RectifiedViews, list[Corners]]:
    views = RectifiedViews(images, X_STEPS, Y_STEPS, 0)  # pyright: ignore[reportArgumentType]
    return views, [find_corners(image, BOARD) for image in views.images]


def test_without_noise_the_plane_is_exact():
    scene = BoardScene(distance_mm=560.0, tilt_deg=(12.0, -20.0, 7.0))
    clean = np.stack([scene.clean(x, y) for x, y in zip(X_STEPS, Y_STEPS, strict=True)])
    slope = fit_board_slope(*board_views(clean))
    assert slope.centre_px == pytest.approx(scene.centre(), abs=2e-3)
    assert slope.slope_px == pytest.approx(scene.plane()[0], abs=1e-4)
    assert slope.plane[1:] == pytest.approx(scene.plane()[1:], abs=2e-6)
    assert slope.corner_slope_px == pytest.approx(scene.plane()[0], abs=5e-4)


def test_a_view_without_corners_is_left_out_and_a_missing_reference_is_refused():
    images = pictures(BoardScene(distance_mm=800.0), noise=2.0)
    views, corners = board_views(images)
    why = TargetError("board behind a hand", reason="not-found")
    slope = fit_board_slope(views, [*corners[:4], why])
    assert slope.views == (0, 1, 2, 3)
    with pytest.raises(TargetError, match="view 0: board behind a hand") as refused:
        fit_board_slope(views, [why, *corners[1:]])
    assert refused.value.reason == "not-found"


def test_same_input_same_output_to_the_last_bit():
    images = pictures(BoardScene(tilt_deg=(5.0, 9.0, -3.0)), noise=2.0)
    first, second = (fit_board_slope(*board_views(images)) for _ in range(2))
    assert first.plane == second.plane
    assert first.sigma_px == second.sigma_px
