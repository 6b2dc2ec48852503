"""Noise between views, around pixels and over grey values, in closed form."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import correlate, gaussian_filter

from rig.epipolar.line import SEEN, UNSEEN, LineFits
from rig.epipolar.noise.cross import measure_cross_noise
from rig.epipolar.noise.local import line_precision, locking, pooled_share, reply_share
from rig.epipolar.noise.model import CrossNoise, NoiseModel, estimate_noise
from rig.epipolar.scales import Scales
from rig.epipolar.search.window import Cameras

RNG = np.random.default_rng(81)
SHAPE = (40, 50)
SCALES = Scales(noise=4.0, texture=12.0, start_error_px=0.5)


def cauchy_shares(scales: Scales) -> tuple[float, float, float]:
    """Expected powers of scatter and step, and of the answer, by summing over both noises."""
    each = np.linspace(-4, 4, 81)
    likely = np.exp(-0.5 * each**2)
    likely /= likely.sum()
    view, reference = np.meshgrid(scales.sampled_share * each, each, indexing="ij")
    both = np.outer(likely, likely)
    d = view - reference
    w = 1 / (1 + (d * scales.smoothed_noise / scales.doubt) ** 2)
    total = (likely[:, None] * w).sum(axis=0)
    mean = (likely[:, None] * w * d).sum(axis=0) / total
    norm = (both * w).sum()
    apart = d - mean
    return (
        float((both * w * apart**2).sum() / norm),
        float((both * w**2 * apart**2).sum() / norm),
        float((both * w * (2 * w - 1)).sum() / norm),
    )


def lines_of(freedom: float, **maps: NDArray[np.float32]) -> LineFits:
    def of(name: str, value: float) -> NDArray[np.float32]:
        return maps.get(name, np.full(SHAPE, value, np.float32))

    return LineFits(
        of("slope_px", 0.0), of("information", 50.0), of("signal", 30.0), of("misfit", 0.0),
        of("scatter", 20.0), of("freedom", freedom),
        maps.get("sight", np.full(SHAPE, SEEN)).astype(np.uint8),
    )  # fmt: skip


def blurred(values: NDArray[np.floating], radius_px: int) -> NDArray[np.float64]:
    side = 2 * radius_px + 1
    return correlate(values.astype(float), np.full((side, side), 1 / side**2), mode="mirror")


@pytest.mark.parametrize(("freedom", "radius_px"), [(30.0, 1), (4.0, 2), (1.5, 4), (0.6, 4)])
def test_precision_is_information_over_the_scatter_around(freedom: float, radius_px: int):
    scatter = RNG.uniform(20, 400, SHAPE).astype(np.float32)
    information = RNG.uniform(1, 90, SHAPE).astype(np.float32)
    lines = lines_of(freedom, scatter=scatter, information=information)
    in_scatter, in_step, _ = cauchy_shares(SCALES)
    power = blurred(scatter, radius_px) / freedom
    power = np.maximum(power, 0.25 * in_scatter * SCALES.smoothed_noise**2)
    expected = information / power * in_scatter / in_step
    assert line_precision(lines, SCALES) == pytest.approx(expected, rel=2e-4)


def test_a_quiet_place_is_no_quieter_than_a_quarter_of_the_picture():
    lines = lines_of(4.0, scatter=np.zeros(SHAPE, np.float32))
    in_step = cauchy_shares(SCALES)[1]
    expected = 50.0 / (0.25 * SCALES.smoothed_noise**2) / in_step
    assert line_precision(lines, SCALES) == pytest.approx(np.full(SHAPE, expected), rel=1e-4)


def test_lines_of_a_pair_tell_their_noise_by_the_slope_that_they_share():
    slope = RNG.normal(0.0, 3.0, SHAPE).astype(np.float32)
    information = RNG.uniform(1, 90, SHAPE).astype(np.float32)
    scatter = RNG.uniform(0, 5, SHAPE).astype(np.float32)
    sight = np.full(SHAPE, SEEN)
    sight[:, 40:] = UNSEEN
    lines = lines_of(0.0, slope_px=slope, information=information, scatter=scatter, sight=sight)
    shared = blurred(information * slope, 4) / blurred(information, 4)
    apart = scatter + information * (slope - shared) ** 2
    freedom = np.where(sight == UNSEEN, 0.0, 1 - 1 / 81)
    in_scatter, in_step, _ = cauchy_shares(SCALES)
    power = blurred(apart, 4) / np.maximum(blurred(freedom, 4), 1e-3)
    power = np.maximum(power, 0.25 * in_scatter * SCALES.smoothed_noise**2)
    expected = information / power * in_scatter / in_step
    assert line_precision(lines, SCALES)[:, :44] == pytest.approx(expected[:, :44], rel=1e-3)


def test_the_reply_is_held_back_by_noise_and_by_weights():
    in_reply = cauchy_shares(SCALES)[2]
    assert reply_share(lines_of(4.0), SCALES) == pytest.approx(in_reply * 0.6, rel=1e-5)
    quiet = lines_of(4.0, signal=np.full(SHAPE, 1.0, np.float32))
    assert reply_share(quiet, SCALES) == 0.3
    nothing = np.zeros(SHAPE, np.float32)
    assert reply_share(lines_of(4.0, signal=nothing, information=nothing), SCALES) == 1.0
    assert locking(SCALES) == pytest.approx([in_reply * c for c in SCALES.locking])


def test_white_noise_without_a_prefilter_is_independent():
    sharp = Scales(noise=0.5, texture=12.0)
    assert pooled_share(np.zeros(SHAPE, np.float32), sharp, 2) == 1.0


@pytest.mark.parametrize(("height", "stride_px"), [(32, 2), (40, 3), (150, 1)])
@pytest.mark.parametrize("is_soft", [True, False])
def test_noise_in_a_sum_of_lines_over_that_of_independent_ones(
    height: int, stride_px: int, is_soft: bool
):
    scales = Scales(noise=8.0 if is_soft else 0.5, texture=12.0)
    grey = gaussian_filter(RNG.normal(0, 30, (height, 60)), 1.2).astype(np.float32)
    lags = np.abs(np.arange(-3, 4))
    likeness = np.outer(0.5**lags, 0.5**lags)
    sigma = scales.prefilter_px

    def kept(weights: NDArray[np.float64]) -> float:
        soft = gaussian_filter(weights, sigma, mode="mirror", truncate=4) if sigma else weights
        return float((soft * correlate(soft, likeness, mode="mirror")).sum())

    single = np.zeros((32, 32))
    single[16, 16] = 1.0
    total = power = 0.0
    for first in range(0, height, 96):
        strip = np.pad(grey[first : first + 32].astype(float), 1, mode="reflect")
        rows, columns = np.indices((strip.shape[0] - 2, 60))
        joined = (rows + columns) % stride_px == 0
        for tilt in (strip[1:-1, 2:] - strip[1:-1, :-2], strip[2:, 1:-1] - strip[:-2, 1:-1]):
            total += kept(tilt * joined)
            power += float(((tilt * joined) ** 2).sum())
    expected = max(total / power / kept(single), 0.5)
    assert pooled_share(grey, scales, stride_px, likeness) == pytest.approx(expected, rel=0.02)


def test_a_plain_picture_pools_nothing():
    soft = Scales(noise=8.0, texture=12.0)
    assert pooled_share(np.zeros(SHAPE, np.float32), soft, 2) == 1.0


MODEL = NoiseModel(3.0, 5.0, 2.0)


def test_noise_grows_with_the_root_of_the_light():
    assert MODEL.sigma_levels(0.0) == pytest.approx((9 + 4 / 12) ** 0.5)
    assert MODEL.sigma_levels(-20.0) == MODEL.sigma_levels(0.0)
    assert MODEL.sigma_levels(100.0) == pytest.approx((9 + 4 / 12 + 20) ** 0.5)


def test_a_raised_model_has_so_many_times_the_noise():
    assert MODEL.raised(1.0) is MODEL
    for grey, ratio in product((0.0, 50.0), (1.5, 3.0)):
        assert MODEL.raised(ratio).sigma_levels(grey) == pytest.approx(
            ratio * MODEL.sigma_levels(grey)
        )
    assert MODEL.raised(2.0).step_levels == 2.0
    # What rounding alone makes cannot be less.
    assert NoiseModel(0.0, 5.0, 2.0).raised(0.5).read_noise_levels == 0.0


def test_white_is_what_grows_by_a_fifth_at_most():
    flat = NoiseModel(10.0, 10.0, 0.0)
    assert flat.is_white(0.0, 439.0)
    assert not flat.is_white(0.0, 441.0)
    assert NoiseModel(0.0, step_levels=0.0).is_white(0.0, 100.0)


def test_stabilised_values_follow_their_formula():
    images = np.array([[[-8.0, 0.0, 50.0, 200.0]]], np.float32)
    floor, rise = 9 + 4 / 12, 0.2
    shown = np.maximum(images, 0)
    root = np.sqrt(floor + rise * shown)
    expected = 2 / rise * (root - np.sqrt(floor))
    found = MODEL.stabilised(images)
    assert found[0, 0, 1:] == pytest.approx(expected[0, 0, 1:], rel=1e-5, abs=1e-5)
    assert found[0, 0, 0] == pytest.approx(-8 / floor**0.5, rel=1e-5)
    dark = NoiseModel(0.0, 4.0, 0.0).stabilised(images)
    least = 1e-3 * 0.25 * 200
    assert dark[0, 0, 0] == pytest.approx(-8 / least**0.5, rel=1e-5)


def test_the_ratio_counts_from_a_quarter_more():
    assert CrossNoise(1.25).excess == 1.0
    assert CrossNoise(1.26).excess == 1.26


@pytest.mark.parametrize("step_levels", [0.0, 6.0])
def test_estimated_noise_keeps_the_rounding_apart(step_levels: float):
    grey = np.linspace(20, 220, 256)[:, None] + np.zeros((256, 256))
    sigma = np.sqrt(16.0 + step_levels**2 / 12 + grey / 8.0)
    found = estimate_noise(
        [(grey + sigma * RNG.normal(size=grey.shape)).astype(np.float32)], step_levels
    )
    assert found.step_levels == step_levels
    assert found.electrons_per_level == pytest.approx(8.0, rel=0.3)
    assert found.read_noise_levels == pytest.approx(4.0, rel=0.3)
    flat = estimate_noise([(100 + 4 * RNG.normal(size=grey.shape)).astype(np.float32)], 3.0)
    assert flat.read_noise_levels == pytest.approx((16 - 0.75) ** 0.5, rel=0.05)
    assert np.isinf(flat.electrons_per_level)


CAMERAS = Cameras(np.array([0.0, 1.0, -1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0, -1.0]), 0)


def scene(noise: float, miss_px: float, shape: tuple[int, int] = (220, 260)) -> NDArray[np.float32]:
    """Waves of amplitudes that differ from place to place, at slope 0.4."""
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]].astype(float)

    def grey(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        strong = 60 * (x / shape[1]) ** 2
        return 120 + strong * (np.sin(0.5 * x + 0.2 * y) + np.cos(0.45 * y - 0.15 * x))

    images = []
    for k, (x, y) in enumerate(zip(CAMERAS.x_steps, CAMERAS.y_steps, strict=True)):
        # Each view misses its lines across by as much, to one side or the other.
        across = miss_px * (1 if k % 2 else -1) * (k > 0)
        images.append(
            grey(columns + 0.4 * x + across * (y != 0), rows + 0.4 * y + across * (x != 0))
        )
    return (np.stack(images) + noise * RNG.normal(size=(5, *shape))).astype(np.float32)


@pytest.mark.parametrize("start_px", [0.9, -0.2])
def test_noise_and_misfit_of_views_are_told_apart(start_px: float):
    slope = np.full((220, 260), start_px, np.float32)
    model = NoiseModel(2.0, step_levels=0.0)
    clean = measure_cross_noise(scene(2.0, 0.0), CAMERAS, slope, model)
    assert clean.ratio == pytest.approx(1.0, rel=0.06)
    assert clean.misfit_px == 0.0
    loud = measure_cross_noise(scene(5.0, 0.0), CAMERAS, slope, model)
    assert loud.ratio == pytest.approx(2.5, rel=0.06)
    missing = measure_cross_noise(scene(2.0, 0.5), CAMERAS, slope, model)
    assert 0.2 < missing.misfit_px < 0.6
    assert missing.ratio == pytest.approx(1.0, rel=0.5)


def test_likeness_is_that_of_the_noise():
    images = scene(0.0, 0.0)
    noise = gaussian_filter(RNG.normal(size=images.shape), (0, 0.8, 0.0))
    images = (images + 4 * noise / noise.std()).astype(np.float32)
    found = measure_cross_noise(
        images, CAMERAS, np.full((220, 260), 0.4, np.float32), NoiseModel(4.0, step_levels=0.0)
    )
    assert found.likeness is not None
    alike = np.exp(-(np.arange(4) ** 2) / (4 * 0.8**2))
    assert found.likeness[3, 3] == 1.0
    assert np.array_equal(found.likeness, found.likeness[::-1, ::-1])
    assert found.likeness[3:, 3] == pytest.approx(alike, abs=0.12)
    assert found.likeness[3, 3:] == pytest.approx([1, 0, 0, 0], abs=0.12)


def test_few_blocks_tell_nothing():
    slope = np.zeros((60, 60), np.float32)
    images = scene(2.0, 0.0, (60, 60))
    told = measure_cross_noise(images, CAMERAS, slope, NoiseModel(2.0))
    # 52 pixels between the borders: 8 blocks of 7 each way.
    assert told.ratio != 1.0
    few = measure_cross_noise(images[:, :, :56], CAMERAS, slope[:, :56], NoiseModel(2.0))
    assert few == CrossNoise()
    blind = measure_cross_noise(images, CAMERAS, slope + 70, NoiseModel(2.0))
    assert blind == CrossNoise()
