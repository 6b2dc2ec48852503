"""What views differ by beside the noise of one picture: none if white, much if it was smoothed."""

from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.noise.cross import measure_cross_noise
from rig.epipolar.noise.model import CrossNoise
from rig.epipolar.scales import noise_of
from rig.epipolar.search.window import Cameras
from tests.support.lightfield import (
    Surface,
    everywhere,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

Array = NDArray[np.float64]

SHAPE = (160, 208)
CAMERAS = Cameras(np.array([0.0, -1.04, 0.97, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, -0.98, 1.05]), 0)
SURFACE = Surface(
    plane(-3.0, 0.02, 0.01), noise_texture(4, mean=120, contrast=22, finest_px=4.0), everywhere
)
FAR = np.hypot(*np.mgrid[-3:4, -3:4]) > 0
BESIDE = ((2, 3), (4, 3), (3, 2), (3, 4))


@cache
def exact() -> Array:
    return render_views([SURFACE], SHAPE, CAMERAS.x_steps, CAMERAS.y_steps, supersample=1)


def with_noise(levels: float, seed: int = 3) -> NDArray[np.uint8]:
    noise = levels * np.random.default_rng(seed).standard_normal((5, *SHAPE))
    return np.clip(np.rint(exact() + noise), 0, 255).astype(np.uint8)


def measure(pictures: NDArray[np.generic], off_px: float = 0.0) -> CrossNoise:
    """As the estimator does, at slopes that are off by so much."""
    images = pictures.astype(np.float32)
    rough_px = (true_slope_px([SURFACE], SHAPE) + off_px).astype(np.float32)
    return measure_cross_noise(images, CAMERAS, rough_px, noise_of(images, 1.0, None))


def likeness_of(found: CrossNoise) -> Array:
    assert found.likeness is not None
    return found.likeness


@pytest.mark.parametrize("levels", [1.0, 2.0, 5.0])
def test_white_noise_is_what_one_picture_tells(levels: float) -> None:
    found = measure(with_noise(levels))
    assert found.excess == 1.0
    assert found.ratio == pytest.approx(1.0, abs=0.2)
    assert found.misfit_px == 0.0


def test_jpeg_hides_noise_from_a_single_picture() -> None:
    stored: list[NDArray[np.uint8]] = []
    for picture in with_noise(3.0):
        is_done, code = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 70])
        assert is_done
        stored.append(np.asarray(cv2.imdecode(code, cv2.IMREAD_GRAYSCALE), np.uint8))
    assert measure(np.stack(stored)).excess > 1.5


def test_a_median_hides_noise_from_a_single_picture() -> None:
    smoothed = np.stack([cv2.medianBlur(picture, 3) for picture in with_noise(4.0)])
    found = measure(smoothed)
    assert found.excess > 1.5
    assert np.mean([likeness_of(found)[at] for at in BESIDE]) > 0.2


def test_slopes_that_are_a_little_off_do_not_count_as_noise() -> None:
    assert measure(with_noise(1.0), off_px=0.7).excess == 1.0


def test_white_noise_has_no_likeness() -> None:
    likeness = likeness_of(measure(with_noise(3.0)))
    assert likeness[3, 3] == 1.0
    # Samples between pixels are a little alike, as is what is left of the one of the reference.
    assert np.abs(likeness[FAR]).max() < 0.15


def blurred(blur_px: float) -> Array:
    rng = np.random.default_rng(5)
    noise = [cv2.GaussianBlur(rng.standard_normal(SHAPE), (0, 0), blur_px) for _ in range(5)]
    return likeness_of(measure(exact() + 12.0 * np.stack(noise)))


def test_blurred_noise_is_alike_as_far_as_the_blur_goes() -> None:
    """Of a Gaussian blur of sigma s, noise d apart correlates by exp(-d^2 / 4 s^2)."""
    likeness, away_px = blurred(0.8), np.hypot(*np.mgrid[-3:4, -3:4])
    assert np.array_equal(likeness, likeness[::-1, ::-1])
    assert np.abs(likeness - np.exp(-(away_px**2) / (4.0 * 0.8**2))).max() < 0.1
    assert blurred(1.2).sum() > 1.4 * likeness.sum()


def test_pictures_that_miss_each_other_across_their_lines_have_misfit_not_noise() -> None:
    pictures = with_noise(1.0).astype(np.float32)
    moved = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5]])
    for i in (1, 2):
        pictures[i] = cv2.warpAffine(
            pictures[i], moved, SHAPE[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT
        )
    assert 0.15 < measure(pictures).misfit_px < 0.8


@pytest.mark.parametrize("shape", [(2, 2), (7, 7), (8, 300), (30, 30)])
def test_tiny_pictures_tell_nothing(shape: tuple[int, int]) -> None:
    images = np.random.default_rng(1).normal(100.0, 5.0, (5, *shape)).astype(np.float32)
    nowhere = np.zeros(shape, np.float32)
    found = measure_cross_noise(
        images, CAMERAS, nowhere, noise_of(with_noise(1.0).astype(np.float32), 1.0, None)
    )
    assert found == CrossNoise()
    assert found.excess == 1.0
