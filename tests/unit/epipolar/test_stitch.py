import numpy as np

from rig.epipolar.behind import behind_jumps
from rig.epipolar.stitch import stitch

RNG = np.random.default_rng(2)
ROWS, COLUMNS = np.mgrid[0:40, 0:50]
PLANE = (1.0 + 0.01 * COLUMNS - 0.02 * ROWS).astype(np.float32)
GREY = np.full(PLANE.shape, 100.0, np.float32)


def run(start: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    information = np.full(line.shape, 4.0, np.float32)
    return stitch(
        start, line.astype(np.float32), information, GREY, radius_px=5, stride_px=1,
        slope_gate_px=1.0, grey_gate=20.0,
    )  # fmt: skip


def test_a_plane_is_kept_exactly() -> None:
    slope, _, misfit = run(PLANE, PLANE)
    assert np.abs(slope - PLANE).max() < 1e-4
    assert misfit.max() < 1e-4


def test_noise_falls_as_the_variance_says() -> None:
    sigma = 0.5  # of one line: information 4 at unit noise
    line = PLANE + sigma * RNG.standard_normal(PLANE.shape)
    slope, variance, _ = run(PLANE, line)
    inner = (slice(8, -8),) * 2
    scaled = (slope - PLANE)[inner] / np.sqrt(variance[inner])
    assert 0.6 < np.std(scaled) < 1.3
    assert np.sqrt(variance[inner]).max() < 0.2 * sigma


def test_another_surface_is_not_stitched_to() -> None:
    step = np.where(COLUMNS < 25, PLANE, PLANE + 3).astype(np.float32)
    slope, _, _ = run(step, step)
    assert np.abs(slope - step).max() < 1e-3


def test_the_first_pixel_behind_a_jump_loses_its_say() -> None:
    step = np.where(COLUMNS < 25, np.float32(0), np.float32(3)).astype(np.float32)
    information = behind_jumps(step, np.ones_like(step), 1.0)
    assert np.all(information[:, 24] < 0.1)
    assert np.all(information[:, :24] == 1)
    assert np.all(information[:, 25:] == 1)


def test_without_information_the_start_stays_and_the_variance_is_infinite() -> None:
    nothing = np.zeros_like(PLANE)
    slope, variance, _ = stitch(
        PLANE, PLANE, nothing, GREY, radius_px=3, stride_px=1, slope_gate_px=1.0, grey_gate=20.0,
    )  # fmt: skip
    assert np.array_equal(slope, PLANE)
    assert np.all(np.isinf(variance))
