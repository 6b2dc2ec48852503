import numpy as np
import pytest

from rig.epipolar.search.shrink import grow, shrink


@pytest.mark.parametrize("factor", [1, 2, 3, 4, 6])
def test_blocks_become_their_mean_and_what_is_left_over_is_cut_off(factor: int) -> None:
    images = np.random.default_rng(0).uniform(0, 9, (3, 25, 38)).astype(np.float32)
    height, width = 25 // factor, 38 // factor
    whole = images[:, : height * factor, : width * factor]
    blocks = whole.reshape(3, height, factor, width, factor).mean(axis=(2, 4))
    assert np.allclose(shrink(images, factor), blocks, atol=1e-5)


def test_whole_numbers_stay_what_they_are() -> None:
    images = np.full((2, 16, 16), 7, np.uint16)
    small = shrink(images, 4)
    assert small.dtype == np.uint16
    assert np.all(small == 7)


def test_grown_values_cover_their_blocks_and_the_rest() -> None:
    grown = grow(np.array([[1, 2], [3, 4]], np.float32), 3, (7, 8))
    assert grown.shape == (7, 8)
    assert np.all(grown[:3, :3] == 1)
    assert np.all(grown[:3, 3:] == 2)
    assert np.all(grown[3:, :3] == 3)
    assert np.all(grown[3:, 3:] == 4)
