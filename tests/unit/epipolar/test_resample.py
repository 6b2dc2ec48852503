"""The resampler against edges whose place is known in closed form."""

import numpy as np
import pytest
from scipy.special import erf

from rig.arrays import Float
from rig.epipolar.resample import Resampler
from rig.errors import SlopeError

HEIGHT, WIDTH = 60, 90
BLUR_PX = 0.6


def edge(x: Float) -> Float:
    """A step seen through a Gaussian lens by square pixels."""
    within = (np.arange(64) + 0.5) / 64 - 0.5
    blurred = 0.5 * (1.0 + erf((x[..., None] + within) / (np.sqrt(2.0) * BLUR_PX)))
    return 200.0 * blurred.mean(axis=-1)


def grid() -> Float:
    return np.stack(np.meshgrid(np.arange(float(WIDTH)), np.arange(float(HEIGHT))), axis=-1)


@pytest.mark.parametrize("angle_deg", [7.0, 83.0, 30.0, -57.0])
@pytest.mark.parametrize("part_px", [0.1, 0.25, 0.4, 0.5, 0.7, 0.8])
def test_edges_stay_where_they_are_to_a_two_hundredth_of_a_pixel(
    angle_deg: float, part_px: float
) -> None:
    """An edge that is slanted against the pixels, moved by a part of a pixel along both axes."""
    across, down = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))

    def place(at: Float) -> Float:
        return (at[..., 0] - 44.3) * across + (at[..., 1] - 29.6) * down

    to_raw = grid() + np.array([part_px, part_px])
    (found,) = Resampler([to_raw], [(HEIGHT, WIDTH)])([edge(place(grid())).astype(np.float32)])
    miss = found - edge(place(to_raw))
    rate = (edge(place(to_raw) + 1e-3) - edge(place(to_raw) - 1e-3)) / 2e-3
    near = (np.abs(place(to_raw)) < 5.0) & (to_raw > 2).all(axis=-1)
    near &= (to_raw[..., 0] < WIDTH - 3) & (to_raw[..., 1] < HEIGHT - 3)
    assert near.sum() > 300
    shift_px = (miss * rate)[near].sum() / (rate**2)[near].sum()
    assert abs(shift_px) < 0.005


def test_a_shift_by_whole_pixels_changes_no_bit() -> None:
    image = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH), dtype=np.uint8)
    resampler = Resampler([grid() + np.array([3.0, -2.0])], [(HEIGHT, WIDTH)])
    (found,) = resampler([image])
    assert found.dtype == np.float32
    assert np.array_equal(found[2:, : WIDTH - 3], image[: HEIGHT - 2, 3:])
    assert resampler.valid[0, 2:, : WIDTH - 3].all()
    assert resampler.valid[0].sum() == (HEIGHT - 2) * (WIDTH - 3)
    # Without source: not black, but what is nearest, and marked.
    assert np.array_equal(found[2:, -3:], np.repeat(image[: HEIGHT - 2, -1:], 3, axis=1))


def test_directions_that_no_camera_looks_in_are_marked() -> None:
    places = grid()
    places[10:12, 20:25] = np.nan
    resampler = Resampler([places], [(HEIGHT, WIDTH)])
    assert not resampler.valid[0, 10:12, 20:25].any()
    assert resampler.valid.sum() == HEIGHT * WIDTH - 10
    (found,) = resampler([np.ones((HEIGHT, WIDTH), np.uint16)])
    assert np.isfinite(found).all()


def test_a_turned_and_bent_map_gives_what_the_formula_says() -> None:
    """Runs of neighbours are cut wherever their sources part; compare with pixel by pixel."""
    numbers = np.random.default_rng(2)
    image = numbers.normal(size=(70, 80)).astype(np.float32)
    offset = grid() - (45.0, 30.0)
    turn = np.array([[0.9, 0.3], [-0.28, 0.95]])
    places = offset @ turn.T * (1.0 + 1e-4 * (offset**2).sum(axis=-1, keepdims=True)) + (38.0, 34.0)
    resampler = Resampler([places], [(70, 80)])
    (found,) = resampler([image])
    inner = (places > 3).all(axis=-1) & (places[..., 0] < 76) & (places[..., 1] < 66)
    assert inner.sum() > 1000
    rows, columns = np.nonzero(inner)
    for row, column in zip(rows[::37], columns[::37], strict=True):
        x, y = places[row, column]
        i, j = int(np.floor(x)), int(np.floor(y))
        patch = image[j - 2 : j + 4, i - 2 : i + 4]
        expected = lagrange(y - j) @ patch @ lagrange(x - i)
        assert found[row, column] == pytest.approx(expected, abs=1e-5)


def lagrange(t: float) -> Float:
    """The quintic that is 1 at one of six neighbours and 0 at the others, for each of them."""
    nodes = np.arange(-2.0, 4.0)
    values = np.eye(6)
    return np.array([np.polyval(np.polyfit(nodes, one, 5), t) for one in values], np.float64)


def test_cameras_of_different_sizes_meet_in_one_frame() -> None:
    resampler = Resampler([grid(), grid() * 2.0], [(HEIGHT, WIDTH), (2 * HEIGHT, 2 * WIDTH)])
    small = np.zeros((HEIGHT, WIDTH), np.uint8)
    assert resampler([small, np.zeros((2 * HEIGHT, 2 * WIDTH), np.uint8)]).shape[0] == 2


def test_pictures_of_another_size_are_refused() -> None:
    resampler = Resampler([grid()], [(HEIGHT, WIDTH)])
    with pytest.raises(SlopeError, match="pictures of 45 x 30 px given, the calibration is of 90"):
        resampler([np.zeros((30, 45), np.uint8)])
