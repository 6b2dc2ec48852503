"""Parts of the searches: labels of a pair, misfits of scattered pixels, the joint channel."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from rig.epipolar.colour import _texture_axis
from rig.epipolar.sampling import pad
from rig.epipolar.search import pair
from rig.epipolar.search.halves import assign_halves
from rig.epipolar.search.search import _misfit
from rig.epipolar.search.window import Cameras, Window
from tests.support.lightfield import noise_texture

RNG = np.random.default_rng(131)
SHAPE = (13, 16)


def window(low: float, high: float) -> Window:
    return Window(*(np.full((2, 3), one, np.float32) for one in (low, high, 0.0)))


@pytest.mark.parametrize(
    ("low", "high", "labels"),
    [
        (0.0, 2.0, [0.0, 0.5, 1.0, 1.5, 2.0]),
        (0.1, 1.6, [0.0, 0.5, 1.0, 1.5, 2.0]),
        (-0.9, -0.6, [-1.0, -0.5, 0.0]),  # three at least
        (0.5, 0.5, [0.5, 1.0, 1.5]),
    ],
)
def test_labels_of_a_pair_shift_it_by_whole_pixels(low: float, high: float, labels: list[float]):
    assert pair._whole_labels(window(low, high), 0.5).tolist() == labels


def test_alike_noise_is_softened_by_six_tenths_of_a_pixel():
    single = np.zeros((1, 15, 15), np.float32)
    single[0, 7, 7] = 1.0
    soft = pair._softened(single)[0]
    gauss = np.exp(-0.5 * (np.arange(-7, 8) / 0.6) ** 2)
    gauss /= gauss.sum()
    assert soft == pytest.approx(np.outer(gauss, gauss), abs=2e-3)


def test_the_misfit_of_a_pixel_is_that_of_its_best_half():
    x, y = np.array([0.0, 1.0, 2.0, -1.0, 0.0]), np.array([0.0, 0.0, 0.5, 0.0, 1.5])
    images = RNG.uniform(0, 100, (5, *SHAPE)).astype(np.float32)
    rows, columns = np.array([0, 6, 12, 3, 9]), np.array([0, 8, 15, 14, 2])
    slopes = np.array([0.5, -1.25, 2.0, 60.0, 1.0], np.float32)
    found = _misfit(pad(images, x, y), SHAPE, Cameras(x, y, 0), rows, columns, slopes)
    half = assign_halves(x, y)
    for n, (v, u, m) in enumerate(zip(rows, columns, slopes, strict=True)):
        of_half: dict[int, list[float]] = {}
        for i in range(1, 5):
            a, b = u - m * x[i], v - m * y[i]
            if 0 <= a <= SHAPE[1] - 1 and 0 <= b <= SHAPE[0] - 1:
                told = map_coordinates(images[i].astype(float), [[b], [a]], order=3, mode="mirror")
                of_half.setdefault(int(half[i]), []).append(abs(float(told[0]) - images[0, v, u]))
        expected = min((float(np.mean(one)) for one in of_half.values()), default=np.inf)
        assert found[n] == pytest.approx(expected, abs=0.02)
    assert np.isinf(found[3])


def test_channels_are_joined_along_the_axis_of_their_steps():
    steps: NDArray[np.float64] = RNG.normal(size=(3, 20, 30))
    steps[1] = 2.0 * steps[0] + 0.1 * steps[1]
    channels = [one.astype(np.float32) for one in steps]
    power = np.zeros((3, 3))
    for axis in (1, 2):
        each = np.diff(steps, axis=axis).reshape(3, -1)
        power += np.einsum("an,bn->ab", each, each)
    values, vectors = np.linalg.eigh(power)
    wanted = vectors[:, np.argmax(values)]
    found = _texture_axis(channels)
    assert found == pytest.approx(wanted * np.sign(wanted.sum()), abs=1e-4)
    assert found.sum() > 0
    assert float(np.linalg.norm(found)) == pytest.approx(1.0)
    opposite = _texture_axis([channels[0], -channels[0]])
    assert np.abs(opposite) == pytest.approx([0.5**0.5] * 2, abs=1e-5)


@pytest.mark.parametrize("start_px", [3.5, 4.5, 6.5])
def test_a_closer_look_reaches_three_half_labels_either_way(start_px: float):
    rows, columns = np.mgrid[0:40, 0:70].astype(float)
    texture = noise_texture(3, mean=120.0, contrast=28.0, finest_px=2.0)
    left = texture(columns, rows).astype(np.float32)
    images = np.stack([left, texture(columns + 5.0, rows).astype(np.float32)])
    start = np.full(left.shape, start_px, np.float32)
    cameras = Cameras(np.array([0.0, 1.0]), np.zeros(2), 0)
    found = pair._closer(images, cameras, start, 1.0, is_alike=False)
    assert np.median(np.abs(found - 5.0)[4:-4, 10:-4]) < 0.05
    assert np.abs(found - start).max() <= 1.5
