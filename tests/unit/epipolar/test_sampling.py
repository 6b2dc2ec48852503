import numpy as np
import pytest

from rig.epipolar.sampling import pad, sample_points, sample_views


def wave(columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return 100 + 40 * np.sin(0.3 * columns) * np.cos(0.2 * rows)


ROWS, COLUMNS = np.mgrid[0:30, 0:40].astype(np.float32)
IMAGE = wave(COLUMNS, ROWS).astype(np.float32)


def sample_everywhere(
    x_step: float, y_step: float, slope_px: float
) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = (index.astype(np.int64).ravel() for index in (ROWS, COLUMNS))
    slope = np.full(rows.shape, slope_px, np.float32)
    steps = np.array([0.0, x_step]), np.array([0.0, y_step])
    splines = pad(np.stack([IMAGE, IMAGE]), *steps)
    seen, grey = sample_views(splines, IMAGE.shape, *steps, rows, columns, slope)
    assert np.allclose(grey[0], IMAGE.ravel(), atol=2e-3)
    return seen[1].reshape(IMAGE.shape), grey[1].reshape(IMAGE.shape)


@pytest.mark.parametrize(("x_step", "y_step"), [(1.3, 0.0), (0.0, -0.7), (0.8, 1.1)])
def test_grey_values_between_pixels_follow_the_function(x_step: float, y_step: float) -> None:
    seen, grey = sample_everywhere(x_step, y_step, 2.4)
    expected = wave(COLUMNS - 2.4 * x_step, ROWS - 2.4 * y_step)
    inner = seen.copy()
    inner[:3] = inner[-3:] = inner[:, :3] = inner[:, -3:] = False
    inner &= np.roll(seen, 3, axis=1) & np.roll(seen, -3, axis=1)
    assert inner.sum() > 300
    assert np.abs(grey - expected)[inner].max() < 0.3


def test_points_outside_the_view_are_not_seen() -> None:
    seen, _ = sample_everywhere(1.0, 0.0, 10.0)
    assert not seen[:, :10].any()
    assert seen[:, 10:].all()


@pytest.mark.parametrize(("x_step", "y_step"), [(1.3, 0.0), (0.0, -0.7), (0.8, 1.1)])
def test_the_derivative_is_that_of_the_sampled_value(x_step: float, y_step: float) -> None:
    columns, rows = (np.full(1, place, np.float32) for place in (20.0, 15.0))
    step = np.float32(x_step), np.float32(y_step)
    padded = pad(IMAGE[None], np.array([x_step]), np.array([y_step]))[0]
    values: list[float] = []
    tilts: list[float] = []
    for slope in (1.63, 1.65, 1.67):
        grey, tilt, seen = (np.empty(1, np.float32) for _ in range(3))
        sample_points(
            padded, 30, 40, columns, rows, np.full(1, slope, np.float32), *step, grey,
            tilt, seen,
        )  # fmt: skip
        values.append(float(grey[0]))
        tilts.append(float(tilt[0]))
    assert tilts[1] == pytest.approx((values[2] - values[0]) / 0.04, rel=0.02)
