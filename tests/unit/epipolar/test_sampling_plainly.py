"""Samples between pixels beside those of another library."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from rig.epipolar.sampling import pad, sample_tilts, sample_views

SHAPE = (9, 12)
IMAGE = np.random.default_rng(3).uniform(0, 200, SHAPE).astype(np.float32)
STEPS = [(1.5, 0.0), (0.0, -1.25), (-0.5, 2.0), (0.0, 0.0)]


def plain(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    return map_coordinates(IMAGE.astype(float), [y, x], order=3, mode="mirror")


@pytest.mark.parametrize(("x_step", "y_step"), STEPS)
def test_values_derivatives_and_sight_of_every_place(x_step: float, y_step: float):
    rng = np.random.default_rng(5)
    columns, rows = rng.uniform(0, 11, 300), rng.uniform(0, 8, 300)
    if x_step == 0 and y_step != 0:
        columns = np.rint(columns)
    if y_step == 0:
        rows = np.rint(rows)
    # Also exactly on the first and the last pixel, and just beyond.
    slope = rng.uniform(-3, 3, 300)
    columns[:4], rows[:4], slope[:4] = [0, 11, 0, 11], [0, 8, 8, 0], 0.0
    single = [one.astype(np.float32) for one in (columns, rows, slope)]
    xs, ys = np.array([0.0, x_step]), np.array([0.0, y_step])
    padded = pad(np.stack([IMAGE, IMAGE]), xs, ys)
    grey, tilt, seen = sample_tilts(padded, SHAPE, xs, ys, single[0], single[1], single[2])
    x, y = columns - slope * x_step, rows - slope * y_step
    inside = (x >= 0) & (x <= 11) & (y >= 0) & (y <= 8)
    assert np.array_equal(seen[1], inside)
    assert inside.sum() > 60
    at = np.where(inside, x, columns), np.where(inside, y, rows)
    assert np.abs(grey[1] - plain(*at)).max() < 0.02
    e = 1e-4
    clear = (np.abs(at[0] - np.rint(at[0])) > 0.01) | (np.abs(at[1] - np.rint(at[1])) > 0.01)
    # At the rim the other library's derivative would look past the picture.
    clear &= (at[0] > e * 2) & (at[0] < 11 - e * 2) & (at[1] > e * 2) & (at[1] < 8 - e * 2)
    rate = (plain(at[0] - e * x_step, at[1] - e * y_step)
            - plain(at[0] + e * x_step, at[1] + e * y_step)) / (2 * e)  # fmt: skip
    assert np.abs(tilt[1] - rate)[clear].max(initial=0.0) < 0.3


def test_lists_of_pixels_are_sampled_by_row_and_column():
    xs, ys = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    padded = pad(np.stack([IMAGE, IMAGE, IMAGE]), xs, ys)
    seen, grey = sample_views(
        padded,
        SHAPE,
        xs,
        ys,
        np.array([0, 4]),
        np.array([3, 11]),
        np.array([2.0, -1.0], np.float32),
    )
    assert seen.tolist() == [[True, True], [True, False], [False, True]]
    assert grey[0] == pytest.approx([IMAGE[0, 3], IMAGE[4, 11]], abs=0.02)
    assert grey[1] == pytest.approx([IMAGE[0, 1], IMAGE[4, 11]], abs=0.02)
    assert grey[2] == pytest.approx([IMAGE[0, 3], IMAGE[5, 11]], abs=0.02)
