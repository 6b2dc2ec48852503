import cv2
import numpy as np
import pytest

from rig.epipolar.line import LineFits, fit_lines
from rig.epipolar.noise.local import line_precision, locking, pooled_share, reply_share
from rig.epipolar.scales import Scales

X_STEPS, Y_STEPS = np.arange(-4.0, 5.0), np.zeros(9)
SHAPE, TRUE_SLOPE_PX = (120, 160), 0.4


def wave(columns: np.ndarray) -> np.ndarray:
    return 120 + 60 * np.sin(0.6 * columns)


@pytest.mark.parametrize("doubt", [60.0, 6.0])
def test_precision_follows_the_noise_of_the_place(doubt: float) -> None:
    rng = np.random.default_rng(5)
    columns = np.arange(SHAPE[1], dtype=float)
    noise = np.where(columns < SHAPE[1] // 2, 3.2, 6.0)
    views = np.stack([np.tile(wave(columns + TRUE_SLOPE_PX * x), (SHAPE[0], 1)) for x in X_STEPS])
    images = (views + noise * rng.standard_normal(views.shape)).astype(np.float32)
    start = np.full(SHAPE, TRUE_SLOPE_PX, np.float32)
    open_to_all = np.zeros(images.shape, np.bool_)
    lines = fit_lines(
        images, X_STEPS, Y_STEPS, 4, start, open_to_all, doubt, 0.0, (0.0, 0.0, 0.0), 1.0
    )
    scales = Scales(noise=4.0, texture=(doubt - 4.0) / 0.035)
    assert scales.doubt == pytest.approx(doubt)
    scores = (lines.slope_px - TRUE_SLOPE_PX) * np.sqrt(line_precision(lines, scales))
    for half in (slice(8, 72), slice(88, 152)):
        steep = np.abs(np.cos(0.6 * columns[half])) > 0.7
        spread = 1.4826 * np.median(np.abs(scores[:, half][:, steep]))
        assert 0.75 < spread < 1.25


def test_a_prefilter_leaves_as_much_noise_in_a_sum_as_told() -> None:
    rng = np.random.default_rng(6)
    scales = Scales(noise=5.0, texture=8.0)
    assert scales.prefilter_px > 0.7
    texture = cv2.GaussianBlur(rng.standard_normal((64, 64)), (0, 0), 1.5).astype(np.float32)
    slope = cv2.Sobel(texture, cv2.CV_32F, 1, 0, ksize=1)
    rows, columns = np.indices(texture.shape)
    slope[(rows + columns) % 2 > 0] = 0
    sums = []
    for _ in range(300):
        noise = 5.0 * rng.standard_normal(texture.shape)
        sums.append((slope * cv2.GaussianBlur(noise, (0, 0), scales.prefilter_px)).sum())
    independent = scales.smoothed_noise**2 * (slope**2).sum()
    assert pooled_share(texture, scales, 2) == pytest.approx(np.var(sums) / independent, rel=0.25)


def test_without_a_prefilter_lines_are_independent() -> None:
    assert pooled_share(np.zeros((8, 8), np.float32), Scales(noise=0.1, texture=8.0), 2) == 1.0


def fit_noisy(steps: np.ndarray, start_px: float, scales: Scales, *, unlock: bool) -> LineFits:
    """Lines of a wave seen at `TRUE_SLOPE_PX` with white noise, from one start."""
    rng = np.random.default_rng(9)
    columns = np.arange(SHAPE[1], dtype=float)
    views = np.stack([np.tile(wave(columns + TRUE_SLOPE_PX * x), (SHAPE[0], 1)) for x in steps])
    images = (views + scales.noise * rng.standard_normal(views.shape)).astype(np.float32)
    drawn = locking(scales) if unlock else (0.0, 0.0, 0.0)
    start = np.full(SHAPE, start_px, np.float32)
    nowhere = np.zeros(images.shape, np.bool_)
    reference = int(np.flatnonzero(steps == 0)[0])
    return fit_lines(
        images, steps, np.zeros(len(steps)), reference, start, nowhere, scales.doubt,
        scales.derivative_variance, drawn, 1.0,
    )  # fmt: skip


def mean_step(lines: LineFits, start_px: float) -> float:
    """Mean over all lines, weighted as stitching does."""
    weight = lines.information[:, 8:-8].astype(float)
    return float((weight * (lines.slope_px[:, 8:-8] - start_px)).sum() / weight.sum())


def test_an_error_of_the_start_is_mended_by_the_share_told() -> None:
    scales = Scales(noise=8.0, texture=100.0)
    steps, error_px = np.arange(-4.0, 5.0), 0.01
    start_px = TRUE_SLOPE_PX + error_px
    lines = fit_noisy(steps, start_px, scales, unlock=True)
    told = reply_share(lines, scales)
    assert 0.4 < told < 0.9
    assert -mean_step(lines, start_px) / error_px == pytest.approx(told, rel=0.2)


def test_noise_does_not_draw_lines_to_whole_pixels() -> None:
    scales = Scales(noise=8.0, texture=100.0)
    assert scales.prefilter_px == 0
    steps = np.array([-0.6, 0.0, 0.6])  # at slope 0.4, about a quarter of a pixel to either side
    drawn = mean_step(fit_noisy(steps, TRUE_SLOPE_PX, scales, unlock=False), TRUE_SLOPE_PX)
    free = mean_step(fit_noisy(steps, TRUE_SLOPE_PX, scales, unlock=True), TRUE_SLOPE_PX)
    assert abs(drawn) > 0.01
    assert abs(free) < 0.35 * abs(drawn)
