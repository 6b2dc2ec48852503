"""Grey scales in closed form, and the noise of samples by convolution."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, spline_filter1d

from rig.epipolar.noise.model import NoiseModel
from rig.epipolar.scales import Scales, measure_scales, noise_of, stabilise

SCALES = Scales(noise=3.0, texture=10.0)


@pytest.mark.parametrize(
    ("noise", "texture", "usual", "sigma_px"),
    [
        (1.0, 10.0, math.inf, 0.0),  # a ratio of a tenth
        (1.7, 10.0, math.inf, 0.0),  # 1.1 * root of 0.07 = 0.291: too little to be worth it
        (1.8, 10.0, math.inf, 1.1 * 0.08**0.5),
        (5.0, 10.0, math.inf, 1.1 * 0.4**0.5),
        (5.0, 10.0, 5.0, 1.1 * 0.9**0.5),
        (5.0, 5.0, 10.0, 1.1 * 0.9**0.5),
        (50.0, 10.0, math.inf, 1.5),
        (1.0, 0.0, math.inf, 1.5),
    ],
)
def test_the_prefilter_grows_with_noise_over_texture(
    noise: float, texture: float, usual: float, sigma_px: float
):
    scales = Scales(noise=noise, texture=texture, usual_texture=usual)
    assert scales.prefilter_px == pytest.approx(sigma_px)


def test_scales_of_differences():
    assert SCALES.truncation == pytest.approx(3.5 * 3 + 0.4 * 10)
    assert replace(SCALES, misfit_px=0.2).truncation == pytest.approx(3.5 * 3 + 0.7 * 10)
    assert SCALES.doubt == pytest.approx(3 + 0.035 * 10)
    off = replace(SCALES, start_error_px=0.3, misfit_px=0.4)
    assert off.doubt == pytest.approx(3 + 0.5 * 10)
    assert SCALES.likeness == pytest.approx(19.0)
    assert SCALES.shrunk_noise == 0.0
    assert replace(SCALES, is_alike=True).shrunk_noise == pytest.approx(0.85 * 3)


def response(scales: Scales, share: float, derivative: int) -> tuple[NDArray[np.float64], float]:
    """Weights of a sample between pixels along its axis, and the power of those across it."""
    grey = np.zeros(121)
    grey[60] = 1.0
    soft = gaussian_filter1d(grey, scales.prefilter_px, truncate=8) if scales.prefilter_px else grey
    coefficients = spline_filter1d(soft, mode="mirror")
    t = np.array([(1 - share) ** 3, 3 * share**3 - 6 * share**2 + 4,
                  3 * (1 - share) ** 3 - 6 * (1 - share) ** 2 + 4, share**3]) / 6  # fmt: skip
    if derivative:
        e = 1e-6
        return (response(scales, share + e, 0)[0] - response(scales, share - e, 0)[0]) / (
            2 * e
        ), 0.0
    return np.convolve(coefficients, t), float((soft**2).sum())


SHARES = (np.arange(16) + 0.5) / 16


@pytest.mark.parametrize("scales", [Scales(0.5, 10.0), Scales(5.0, 10.0)], ids=["sharp", "soft"])
def test_noise_of_samples(scales: Scales):
    values = [response(scales, share, 0) for share in SHARES]
    tilts = [response(scales, share, 1)[0] for share in SHARES]
    across = values[0][1]
    left = scales.noise * across
    assert scales.smoothed_noise == pytest.approx(left, rel=1e-3)
    power = across * np.mean([(one**2).sum() for one, _ in values])
    assert scales.sampled_share == pytest.approx(scales.noise * power**0.5 / left, rel=1e-3)
    steep = scales.noise**2 * across * np.mean([(one**2).sum() for one in tilts])
    assert scales.derivative_variance == pytest.approx(steep, rel=1e-3)
    c1, c3, c5 = scales.locking
    s = SHARES - 0.5
    covariance = [
        scales.noise**2 * across * (v @ d) for (v, _), d in zip(values, tilts, strict=True)
    ]
    assert c1 * s + c3 * s**3 + c5 * s**5 == pytest.approx(
        np.array(covariance), abs=0.01 * np.abs(covariance).max()
    )


def checkers(levels: float) -> NDArray[np.float32]:
    rows, columns = np.mgrid[0:40, 0:50]
    return (100 + levels * ((rows // 4 + columns // 4) % 2)).astype(np.float32)


def test_texture_is_what_neighbours_differ_by_beyond_their_noise():
    grey = checkers(40.0)
    told = measure_scales(np.stack([grey, grey]), 1, 2.0)
    # Of 39 x 50 steps down 9 rows of 50 are edges, of 40 x 49 along 12 columns.
    power = 0.5 * (1600 * 9 / 39 + 1600 * 12 / 49)
    assert told.noise > 2.0
    assert told.texture == pytest.approx((power - 2 * told.noise**2) ** 0.5, rel=1e-5)
    assert measure_scales(np.stack([grey, grey]), 1, 6.0).noise == 6.0
    assert not math.isinf(told.usual_texture)


def test_a_picture_without_texture_keeps_a_floor():
    flat = np.full((2, 30, 30), 7.0, np.float32)
    told = measure_scales(flat, 0)
    assert told.noise == told.texture == told.usual_texture == pytest.approx(1e-9)
    step = flat.copy()
    step[:, 29, 29] = 17.0
    told = measure_scales(step, 0, 5.0)
    # One pixel of 900 differs by 10: less than the noise makes of all.
    assert told.texture == pytest.approx(1e-4 * 10 + 1e-9)
    assert told.usual_texture == pytest.approx(1e-4 * 10 + 1e-9)


def test_usual_texture_is_twice_that_of_three_quarters_of_the_picture():
    rows, columns = np.mgrid[0:33, 0:33].astype(float)
    grey = np.zeros((33, 33), np.float32)
    # Each block of 8 x 8 steps has its own steepness, both ways.
    steep = np.arange(16.0).reshape(4, 4)
    for i, k in np.ndindex(4, 4):
        block = np.s_[8 * i : 8 * i + 9, 8 * k : 8 * k + 9]
        grey[block] = ((steep[i, k] + 1) * (rows + columns))[block]
    along, down = np.diff(grey, axis=1)[:-1], np.diff(grey, axis=0)[:, :-1]
    power = 0.5 * (along**2 + down**2)
    blocks = power.reshape(4, 8, 4, 8).mean(axis=(1, 3)).ravel()
    told = measure_scales(np.stack([grey, grey]), 0, 1.5)
    noise = told.noise
    assert told.usual_texture == pytest.approx(
        2 * (np.quantile(blocks, 0.75) - 2 * noise**2) ** 0.5, rel=1e-5
    )


def test_noise_is_the_median_over_some_views():
    rng = np.random.default_rng(1)
    noises = np.array([2.0, 90.0, 4.0, 90.0, 6.0, 90.0])
    images = (100 + noises[:, None, None] * rng.normal(size=(6, 80, 80))).astype(np.float32)
    assert measure_scales(images, 0).noise == pytest.approx(4.0, rel=0.1)
    # Views 0, 2 and 4 are asked: every second of six, for three.
    seven = np.concatenate([images, images[:1]])
    assert measure_scales(seven, 0).noise == pytest.approx(2.0, rel=2.5)


def test_known_noise_is_taken_as_it_is():
    known = NoiseModel(4.0, 2.0)
    images = np.zeros((2, 30, 30), np.float32)
    assert noise_of(images, 1.0, known) is known
    assert noise_of(images, 1.0, None).step_levels == 1.0


def ramp(noise: float) -> NDArray[np.float32]:
    rows = np.linspace(10, 210, 160)[:, None] + np.zeros((160, 160))
    return (rows + noise * np.random.default_rng(3).normal(size=rows.shape)).astype(np.float32)


def test_white_noise_leaves_grey_values_and_shot_noise_does_not():
    images = np.stack([ramp(2.0), ramp(2.0)])
    same, grading = stabilise(images, 0, NoiseModel(2.0, step_levels=0.0), is_told=False)
    assert same is images
    assert grading.scales.noise == 2.0
    same, grading = stabilise(images, 0, NoiseModel(0.5, step_levels=0.0), is_told=True)
    assert same is images
    assert grading.scales.noise == pytest.approx(2.0, rel=0.1)
    shot = NoiseModel(1.0, 4.0, 0.0)
    stable, grading = stabilise(images, 0, shot, is_told=False)
    assert np.array_equal(stable, shot.stabilised(images))
    assert grading.scales.noise == 1.0
    # One electron in a hundred levels hardly adds to a noise of 2: the middle grey value counts.
    slight = NoiseModel(2.0, 150.0, 0.0)
    same, grading = stabilise(images, 0, slight, is_told=False)
    assert same is images
    assert grading.scales.noise == pytest.approx(
        slight.sigma_levels(float(np.median(images[0, ::8, ::8])))
    )
