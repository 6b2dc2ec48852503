"""The joint line fit of a board, against closed-form truth."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar import RectifiedViews
from rig.epipolar.board import fit
from rig.epipolar.board.fit import fit_board_slope
from rig.errors import SlopeError, TargetError
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import Corners, find_corners
from tests.support.board_images import BoardScene, digitised
from tests.support.slope_bound import slope_bound_px

BOARD = Checkerboard(9, 6, 25.0)
X_STEPS = np.array([0.0, -1.1, 0.93, 0.0, 0.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -1.05, 0.96])
EVEN = np.array([-1.0, 0.0, 1.0])
GAINS = (1.0, 1.02, 0.98, 1.01, 0.97)
SMALL = BoardScene(width=320, height=240, focal_px=330.0, focus_mm=600.0, distance_mm=560.0)

Image = NDArray[np.uint8] | NDArray[np.float32]


def clean_pictures(
    scene: BoardScene, x_steps: Float = X_STEPS, y_steps: Float = Y_STEPS
) -> list[NDArray[np.float32]]:
    return [scene.clean(x, y) for x, y in zip(x_steps, y_steps, strict=True)]


def noisy(
    clean: list[NDArray[np.float32]],
    rng: np.random.Generator,
    *,
    noise: float = 2.0,
    gains: tuple[float, ...] = GAINS,
) -> NDArray[np.uint8]:
    return np.stack(
        [
            digitised(view, noise=noise, rng=rng, gain=gain)
            for view, gain in zip(clean, gains, strict=False)
        ]
    )


def board_views(images: Image) -> tuple[RectifiedViews, list[Corners]]:
    views = RectifiedViews(images, X_STEPS, Y_STEPS, 0)
    return views, [find_corners(image, BOARD) for image in views.images]


@pytest.mark.parametrize("tilt_deg", [(0.0, 0.0, 0.0), (12.0, -20.0, 7.0), (-15.0, 25.0, 90.0)])
def test_without_noise_the_plane_is_exact(tilt_deg: tuple[float, float, float]):
    scene = SMALL.with_changes(tilt_deg=tilt_deg, offset_mm=(20.0, -10.0))
    slope = fit_board_slope(*board_views(np.stack(clean_pictures(scene))))
    assert slope.centre_px == pytest.approx(scene.centre(), abs=3e-3)
    assert slope.slope_px == pytest.approx(scene.plane()[0], abs=3e-4)
    assert slope.plane[1:] == pytest.approx(scene.plane()[1:], abs=5e-6)
    assert slope.corner_slope_px == pytest.approx(scene.plane()[0], abs=2e-3)
    assert slope.slope_at(*scene.centre()) == pytest.approx(slope.slope_px, abs=1e-4)


@pytest.mark.parametrize(
    ("blur_px", "noise", "times"),
    [
        (0.9, 1.0, 1.1),
        pytest.param(0.9, 5.0, 1.1, marks=pytest.mark.slow),
        pytest.param(0.6, 2.0, 1.5, marks=pytest.mark.slow),
    ],
)
def test_error_is_near_the_bound_and_sigma_tells_it(blur_px: float, noise: float, times: float):
    scene = SMALL.with_changes(blur_px=blur_px, tilt_deg=(15.0, 20.0, 10.0))
    clean, rng, samples = clean_pictures(scene), np.random.default_rng(7), 24
    images = noisy(clean, rng, noise=noise)
    views, corners = board_views(images)
    fits = [fit_board_slope(views, corners)]
    while len(fits) < samples:
        again = RectifiedViews(noisy(clean, rng, noise=noise), X_STEPS, Y_STEPS, 0)
        fits.append(fit_board_slope(again, corners))
    slope = np.array([fit.slope_px for fit in fits])
    bound = slope_bound_px(clean[0], fits[0], X_STEPS, Y_STEPS, noise)
    # 24 samples know their own scatter to 15 %: two of these are allowed for.
    assert np.std(slope) < times * bound * 1.3
    assert abs(np.mean(slope) - scene.plane()[0]) < bound
    sigma = np.array([fit.sigma_px for fit in fits])
    assert np.std(slope) / np.mean(sigma) == pytest.approx(1.0, abs=0.35)
    assert np.std([fit.corner_slope_px for fit in fits]) < 1e-9


def test_gain_and_offset_of_a_view_do_not_pull_the_slope():
    images = np.stack(clean_pictures(SMALL.with_changes(tilt_deg=(0.0, 0.0, 30.0))))
    plain = fit_board_slope(*board_views(images))
    images[1] = images[1] * np.float32(1.3) + 12
    changed = fit_board_slope(*board_views(images))
    assert changed.slope_px == pytest.approx(plain.slope_px, abs=1e-4)
    assert changed.gains[1] / changed.gains[0] == pytest.approx(1.3, rel=1e-3)


def test_rows_that_miss_do_not_pull_the_slope():
    scene = SMALL.with_changes(tilt_deg=(3.0, -5.0, 2.0))
    clean = clean_pictures(scene)
    columns, rows = np.meshgrid(np.arange(320.0, dtype=np.float32), np.arange(240.0))
    low_px = (1.2 + 0.6 * (columns / 160.0 - 1.0) * (rows / 120.0 - 1.0)).astype(np.float32)
    clean[2] = cv2.remap(
        clean[2], columns, rows.astype(np.float32) - low_px, cv2.INTER_LANCZOS4
    ).astype(np.float32)
    straight = fit_board_slope(*board_views(np.stack(clean_pictures(scene))))
    bent = fit_board_slope(*board_views(np.stack(clean)))
    assert bent.track_residual_px > 0.3  # rows that miss are still said
    assert bent.slope_px == pytest.approx(straight.slope_px, abs=1e-3)
    assert bent.corner_slope_px == pytest.approx(straight.corner_slope_px, abs=1e-3)


def test_the_background_behind_the_board_does_not_pull_the_slope():
    scene = SMALL.with_changes(
        background_contrast=100.0, background_mm=5000.0, margin_squares=0.0, distance_mm=450.0
    )
    slope = fit_board_slope(*board_views(np.stack(clean_pictures(scene))))
    assert slope.slope_px == pytest.approx(scene.plane()[0], abs=1e-3)


def wrong_periods(boards: int, frames: int, seed: int) -> int:
    """Frames of evenly spaced views whose slope is off by a quarter of a period or more."""
    rng, wrong, still = np.random.default_rng(seed), 0, np.zeros(3)
    for _ in range(boards):
        scene = SMALL.with_changes(
            distance_mm=float(rng.uniform(330, 700)),
            tilt_deg=tuple(rng.uniform(-25, 25, 3)),
            offset_mm=tuple(rng.uniform(-15, 15, 2)),
            blur_px=float(rng.uniform(0.6, 1.4)),
            pitch_mm=float(rng.uniform(10, 40)),
        )
        clean = clean_pictures(scene, EVEN, still)
        for _ in range(frames):
            images = noisy(clean, rng, noise=3.0)
            corners = [find_corners(image, BOARD) for image in images]
            slope = fit_board_slope(RectifiedViews(images, EVEN, still, 1), corners)
            wrong += abs(slope.slope_px - scene.plane()[0]) > slope.period_px / 4
    return wrong


def test_evenly_spaced_views_give_the_right_period():
    assert wrong_periods(boards=3, frames=2, seed=1) == 0


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_no_wrong_period_in_a_thousand_frames():
    assert wrong_periods(boards=100, frames=10, seed=2) == 0


def test_a_view_without_corners_is_left_out_and_a_missing_reference_is_refused():
    images = noisy(clean_pictures(SMALL), np.random.default_rng(1))
    views, corners = board_views(images)
    why = TargetError("board behind a hand", reason="not-found")
    slope = fit_board_slope(views, [*corners[:4], why])
    assert slope.views == (0, 1, 2, 3)
    assert fit_board_slope(views, [*corners[:4], None]).plane == slope.plane
    with pytest.raises(TargetError, match="view 0: board behind a hand") as refused:
        fit_board_slope(views, [why, *corners[1:]])
    assert refused.value.reason == "not-found"
    with pytest.raises(TargetError, match="in 1 of 5; view 1: no corners"):
        fit_board_slope(views, [corners[0], None, None, None, None])
    with pytest.raises(TargetError, match="4 views given for 5"):
        fit_board_slope(views, corners[:4])


def test_different_boards_in_two_views_are_refused():
    views, corners = board_views(noisy(clean_pictures(SMALL), np.random.default_rng(1)))
    other = find_corners(SMALL.with_changes(columns=8).clean(), Checkerboard(8, 6, 25.0))
    with pytest.raises(TargetError, match="different counts"):
        fit_board_slope(views, [corners[0], other, *corners[2:]])


def test_corners_of_another_moment_are_noticed():
    views, corners = board_views(noisy(clean_pictures(SMALL), np.random.default_rng(1)))
    moved = SMALL.with_changes(distance_mm=400.0)
    stale = [find_corners(moved.clean(x, y), BOARD) for x, y in zip(X_STEPS, Y_STEPS, strict=True)]
    with pytest.raises(SlopeError, match="line fit of the board"):
        fit_board_slope(views, [corners[0], *stale[1:]])


def test_same_input_same_output_to_the_last_bit():
    images = noisy(clean_pictures(SMALL), np.random.default_rng(1))
    first, second = (fit_board_slope(*board_views(images)) for _ in range(2))
    assert first.plane == second.plane
    assert first.sigma_px == second.sigma_px


@pytest.mark.parametrize(("side_px", "out"), [(20.0, 0.75), (10.0, 0.5), (4.0, 0.0)])
def test_the_outline_keeps_five_pixels_inside_the_outer_squares(side_px: float, out: float):
    rows, columns = 4, 6
    row, column = np.mgrid[:rows, :columns].astype(np.float64)
    xy_px = np.stack([column, row], axis=-1) * side_px + 100.0
    centre_px, outline_px = fit._outline(xy_px, side_px)
    assert centre_px == pytest.approx([100.0 + 2.5 * side_px, 100.0 + 1.5 * side_px])
    places = (outline_px - 100.0) / side_px
    right, bottom = columns - 1 + out, rows - 1 + out
    wanted = np.array([[-out, -out], [right, -out], [right, bottom], [-out, bottom]])
    assert places == pytest.approx(wanted, abs=1e-6)
