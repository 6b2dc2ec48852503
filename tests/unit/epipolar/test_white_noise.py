"""Blocks of an image, against means and differences that numpy takes."""

import numpy as np
import pytest

from rig.epipolar.noise.white import blocks_of, blocks_of_all, noise_grey

RNG = np.random.default_rng(21)


def grain(height: int, width: int) -> np.ndarray:
    return RNG.normal(100.0, 4.0, (height, width)).astype(np.float32)


def second_difference(image: np.ndarray) -> np.ndarray:
    """(H - 2, W - 2) of every inner pixel, in both directions after each other."""
    image = image.astype(np.float64)
    rows = image[:-2] - 2 * image[1:-1] + image[2:]
    return rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:]


def in_blocks(inner: np.ndarray, block: int = 16) -> np.ndarray:
    """(N, block * block) of whole blocks."""
    rows, columns = inner.shape[0] // block, inner.shape[1] // block
    cut = inner[: rows * block, : columns * block].reshape(rows, block, columns, block)
    return cut.transpose(0, 2, 1, 3).reshape(rows * columns, -1)


@pytest.mark.parametrize("shape", [(34, 50), (49, 66), (18, 18)])
def test_blocks_are_what_numpy_says(shape: tuple[int, int]) -> None:
    image = grain(*shape)
    # Extremes on the border, which belongs to no block: no block is thought to be clipped.
    image[0, 0], image[0, 1] = 0.0, 255.0
    blocks = blocks_of(image)
    inner = in_blocks(image[1:-1, 1:-1].astype(np.float64))
    assert blocks.grey == pytest.approx(inner.mean(axis=1), rel=1e-5)
    assert blocks.spread == pytest.approx(inner.std(axis=1), rel=2e-3)
    size = np.abs(in_blocks(second_difference(image))).mean(axis=1)
    assert blocks.noise == pytest.approx(np.sqrt(np.pi / 2) / 6 * size, rel=1e-4)


def test_a_small_picture_is_one_block() -> None:
    image = grain(7, 9)
    blocks = blocks_of(image)
    assert blocks.grey.shape == (1,)
    assert blocks.grey[0] == pytest.approx(float(image[1:6, 1:6].mean()), rel=1e-5)


@pytest.mark.parametrize("shape", [(2, 9), (9, 2), (1, 1), (2, 2)])
def test_a_picture_without_an_inner_pixel_says_nothing(shape: tuple[int, int]) -> None:
    assert blocks_of(grain(*shape)).noise.size == 0
    assert noise_grey(grain(*shape)) == 0.0


def test_three_pixels_square_are_the_least() -> None:
    assert blocks_of(grain(3, 3)).noise.size == 1


def test_blocks_at_the_ends_of_the_range_do_not_count() -> None:
    image = grain(34, 66)  # two rows of four blocks
    image[5, 5], image[5, 40] = 0.0, 255.0
    grey = blocks_of(image).grey
    inner = in_blocks(image[1:-1, 1:-1].astype(np.float64)).mean(axis=1)
    assert grey == pytest.approx(np.delete(inner, [0, 2]), rel=1e-5)


def test_where_nearly_all_blocks_may_be_clipped_all_count() -> None:
    image = grain(18, 34)  # one row of two blocks, both at an end
    image[5, 5], image[5, 25] = 0.0, 255.0
    assert blocks_of(image).grey.size == 2


def test_a_tenth_of_the_blocks_that_is_clear_is_enough() -> None:
    image = grain(18, 162)  # one row of ten blocks
    image[5, 5::16] = 255.0
    image[5, 5] = 100.0
    assert blocks_of(image).grey.size == 1 or image[1:17, 1:17].min() == image.min()
    image[0, 0] = 0.0
    assert blocks_of(image).grey.size == 1


def test_flat_blocks_say_nothing() -> None:
    image = grain(18, 34)
    image[:, :20] = 100.0
    image[0, 0], image[0, 1] = 0.0, 255.0
    # The corner lies in the window of the first block alone.
    flat = image.copy()
    flat[0, :2] = 100.0
    assert blocks_of(flat).grey.size == 1


def test_several_images_are_measured_one_by_one() -> None:
    images = [grain(20, 20 + 16 * count) for count in range(3)]
    for found, image in zip(blocks_of_all(images), images, strict=True):
        assert np.array_equal(found.noise, blocks_of(image).noise)


def test_the_quietest_tenth_tells_the_noise() -> None:
    quiet = grain(130, 130)
    loud = quiet.copy()
    loud[:, 34:] = 100.0 + 50.0 * (loud[:, 34:] - 100.0)
    # A quarter of the blocks is quiet in one, all are in the other.
    assert noise_grey(loud) == pytest.approx(noise_grey(quiet), rel=0.15)
    loud[:, 2:] = 100.0 + 50.0 * (loud[:, 2:] - 100.0)
    assert noise_grey(loud) > 10.0 * noise_grey(quiet)
