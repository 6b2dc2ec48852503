"""What the line fit of a board says of its own error, on pictures that are not ideal."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews
from rig.epipolar.board.corner_tracks import fit_corner_tracks
from rig.epipolar.board.fit import fit_board_slope
from rig.epipolar.board.slope import BoardSlope
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import find_corners
from tests.support.board_degradations import skewed, tilted_light, vignetted
from tests.support.board_images import BoardScene, blurred, digitised

BOARD = Checkerboard(9, 6, 25.0)
X_STEPS = np.array([0.0, -1.1, 0.93, 0.0, 0.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -1.05, 0.96])
LIGHT = ((0.0, 0.0), (0.3, -0.2), (-0.3, 0.1), (0.2, 0.3), (-0.1, -0.3))
SCENE = BoardScene(
    width=320, height=240, focal_px=330.0, focus_mm=600.0, distance_mm=560.0,
    blur_px=0.6, tilt_deg=(15.0, 20.0, 10.0),
)  # fmt: skip
TRUE_PX = float(SCENE.plane()[0])
SAMPLES = 16

Grey = NDArray[np.float32]


@pytest.fixture(scope="module")
def sharp() -> list[Grey]:
    return [SCENE.sharp(x, y) for x, y in zip(X_STEPS, Y_STEPS, strict=True)]


@pytest.fixture(scope="module")
def clean(sharp: list[Grey]) -> list[Grey]:
    return [blurred(view, SCENE.blur_px) for view in sharp]


def fit_of(images: NDArray[np.uint8] | Grey) -> BoardSlope:
    corners = [find_corners(image, BOARD) for image in images]
    return fit_board_slope(RectifiedViews(images, X_STEPS, Y_STEPS, 0), corners)


def fits_of(clean: list[Grey], samples: int = SAMPLES) -> list[BoardSlope]:
    rng = np.random.default_rng(3)
    return [
        fit_of(np.stack([digitised(view, noise=1.0, rng=rng) for view in clean]))
        for _ in range(samples)
    ]


def scatter_over_sigma(fits: list[BoardSlope]) -> float:
    """16 samples know their own scatter to 18 %."""
    return float(np.std([fit.slope_px for fit in fits]) / np.mean([fit.sigma_px for fit in fits]))


@pytest.mark.slow
def test_light_that_changes_across_the_board_neither_pulls_the_slope_nor_widens_sigma(
    clean: list[Grey],
):
    lit = [tilted_light(view, np.array(change)) for view, change in zip(clean, LIGHT, strict=True)]
    fits = fits_of(lit)
    assert scatter_over_sigma(fits) == pytest.approx(1.0, abs=0.35)
    assert np.mean([fit.slope_px for fit in fits]) == pytest.approx(TRUE_PX, abs=1.5e-4)


def test_without_noise_differing_vignettes_leave_hardly_any_residual(clean: list[Grey]):
    rng = np.random.default_rng(4)
    lit = [vignetted(view, rng.uniform(0.2, 0.4), rng.uniform(-40, 40, 2)) for view in clean]
    fit = fit_of(np.stack(lit))
    assert fit.slope_px == pytest.approx(TRUE_PX, abs=1e-4)
    assert fit.residual < 1.2 * fit_of(np.stack(clean)).residual


@pytest.mark.slow
def test_one_view_out_of_focus_does_not_widen_sigma(sharp: list[Grey], clean: list[Grey]):
    defocused = [*clean]
    defocused[1] = blurred(sharp[1], 1.6)
    assert scatter_over_sigma(fits_of(defocused)) == pytest.approx(1.0, abs=0.35)


@pytest.mark.slow
def test_noise_that_a_median_has_correlated_is_told(clean: list[Grey]):
    rng = np.random.default_rng(6)
    fits = [
        fit_of(
            np.stack(
                [cv2.medianBlur(digitised(view, noise=3.0, rng=rng), 3) for view in clean]
            ).astype(np.uint8)
        )
        for _ in range(SAMPLES)
    ]
    assert scatter_over_sigma(fits) == pytest.approx(1.0, abs=0.35)


def test_an_asymmetric_lens_in_one_view_is_measured_and_widens_both_sigmas(clean: list[Grey]):
    views = [*clean]
    # Centroids stay in place, so the truth is theirs.
    views[1] = skewed(views[1], 0.15, 1.5)
    for fit in fits_of(views, samples=4):
        assert fit.asymmetry_px == pytest.approx(TRUE_PX - fit.slope_px, rel=0.5)
        assert abs(fit.slope_px - TRUE_PX) < 1.5 * fit.sigma_px
        assert abs(fit.corner_slope_px - TRUE_PX) < 1.5 * fit.corner_sigma_px


@pytest.mark.slow
def test_symmetric_blur_that_differs_is_no_asymmetry(sharp: list[Grey], clean: list[Grey]):
    views = [*clean]
    views[2] = blurred(sharp[2], 1.2)
    fits = fits_of(views, samples=8)
    assert np.mean([fit.asymmetry_px != 0.0 for fit in fits]) < 0.3
    assert np.mean([abs(fit.asymmetry_px) for fit in fits]) < 3e-4


@pytest.mark.slow
def test_what_interpolation_does_to_a_board_that_faces_the_views_is_told():
    """Every edge is at the same fraction of a pixel from its copies: nothing averages out."""
    facing = SCENE.with_changes(tilt_deg=(0.0, 0.0, 3.0))
    fits = fits_of([facing.clean(x, y) for x, y in zip(X_STEPS, Y_STEPS, strict=True)], samples=6)
    errors = np.array([(fit.slope_px - TRUE_PX) / fit.sigma_px for fit in fits])
    assert np.sqrt(np.mean(errors**2)) < 1.25


def test_light_from_one_side_does_not_widen_the_sigma_of_the_tracks():
    turned = SCENE.with_changes(tilt_deg=(10.0, -5.0, 12.0))
    places = zip(X_STEPS, Y_STEPS, LIGHT, strict=True)
    lit = [tilted_light(turned.clean(x, y), 2 * np.array(change)) for x, y, change in places]
    xy_px = [find_corners(view, BOARD).xy_px for view in lit]
    tracks = fit_corner_tracks(xy_px, X_STEPS, Y_STEPS, 0, turned.centre())
    # 8e-5 where both colours of corners have one plane; 1e-5 without the light.
    assert tracks.sigma_px < 6e-5
