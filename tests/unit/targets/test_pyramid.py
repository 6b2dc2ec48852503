"""Places and pictures at halved resolutions."""

import numpy as np
import pytest

from rig.targets.pyramid import at_level, from_level, pyramid, search_order


def test_places_are_of_pixel_middles() -> None:
    at = np.array([[0.0, 1.0], [10.0, 20.0]])
    assert from_level(at, 0).tolist() == at.tolist()
    assert from_level(at, 1).tolist() == [[0.5, 2.5], [20.5, 40.5]]
    assert from_level(at, 2).tolist() == [[1.5, 5.5], [41.5, 81.5]]
    for level in range(3):
        assert at_level(from_level(at, level), level).tolist() == at.tolist()
    assert at_level(np.array([[1.5, 5.5]]), 2).tolist() == [[0.0, 1.0]]


def test_a_coarser_pixel_is_the_mean_of_four() -> None:
    picture = np.random.default_rng(1).integers(0, 255, (131, 67), dtype=np.uint8)
    whole, half = pyramid(picture, 2)
    assert whole.dtype == half.dtype == np.float32
    assert whole.tolist() == picture.tolist()
    assert half.shape == (65, 33)
    even = picture[:130, :66].astype(np.float64).reshape(65, 2, 33, 2).mean(axis=(1, 3))
    assert half == pytest.approx(even, abs=1e-4)


@pytest.mark.parametrize(
    ("shape", "sides"),
    [
        ((256, 300), [256, 128, 64]),
        ((64, 300), [64, 32]),
        ((300, 64), [300, 150]),
        ((63, 300), [63]),
    ],
)
def test_none_is_needlessly_small(shape: tuple[int, int], sides: list[int]) -> None:
    found = pyramid(np.zeros(shape, np.uint16), 3)
    assert [one.shape[0] for one in found] == sides
    assert len(pyramid(np.zeros((512, 512), np.float32), 4)) == 4


@pytest.mark.parametrize(
    ("shape", "order"),
    [((500, 1000), [0, 1, 2]), ((500, 1001), [1, 0, 2]), ((10, 10), [0, 1, 2])],
)
def test_large_pictures_are_searched_at_half_resolution_first(
    shape: tuple[int, int], order: list[int]
) -> None:
    first = np.empty(shape, np.float32)
    assert search_order([first, first[:1], first[:1]]) == order
    assert search_order([np.empty((1000, 1000), np.float32)]) == [0]
