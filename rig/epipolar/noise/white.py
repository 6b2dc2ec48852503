"""What one image says about its white noise, block by block.

The second difference in both directions kills planes and straight ramps (J. Immerkaer, "Fast noise
variance estimation", CVIU 64, 1996); the quietest tenth of the blocks tells the noise, so that
texture does not count.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.rank import quantile

_BLOCK_PX = 16
QUIET_SHARE = 0.1
"""Share of the blocks that tell the noise."""
# Median ratio of the quiet-share quantile to the mean over blocks of pure white noise, 16 x 16 px.
_QUIET_RATIO = 0.885
_PER_DIFFERENCE = float(np.sqrt(np.pi / 2) / 6)
"""Sigma of white noise over the mean size of its second difference."""
_ENOUGH_SHARE = 0.1
"""Share of the blocks that must be clear of clipping for only those to count."""


@dataclass(frozen=True, slots=True)
class Blocks:
    """Square parts of images, (N,) each."""

    grey: NDArray[np.float32]
    """Mean grey value."""
    spread: NDArray[np.float32]
    """Standard deviation of the grey values, noise and texture together."""
    noise: NDArray[np.float32]
    """White noise if there is no texture, 1 sigma; never less than what there is."""

    def __getitem__(self, chosen: NDArray[np.bool_]) -> "Blocks":
        return Blocks(self.grey[chosen], self.spread[chosen], self.noise[chosen])

    @property
    def quiet_noise(self) -> float:
        """White noise of the quietest of them, 1 sigma; 0 without any."""
        if not len(self.noise):
            return 0.0
        return quantile(self.noise, QUIET_SHARE) / _QUIET_RATIO


def blocks_of(image: NDArray[np.float32]) -> Blocks:
    """Measure the blocks of an image (H, W).

    Blocks without any variation are clipped or synthetic, and say nothing; nor do those that hold a
    pixel at the darkest or brightest grey value of the image, where it may be clipped, unless
    nearly all of them do.
    """
    height, width = image.shape
    block = min(_BLOCK_PX, height - 2, width - 2)
    shape = (max(height - 2, 0) // block, max(width - 2, 0) // block) if block > 0 else (0, 0)
    differences, grey, square, low, high = np.empty((5, *shape), np.float32)
    if grey.size:
        _measure(image, block, differences, grey, square, low, high)
    varied = differences > 0
    clear = varied & (low > image.min()) & (high < image.max()) if grey.size else varied
    chosen = clear if clear.sum() >= _ENOUGH_SHARE * varied.sum() else varied
    spread = np.sqrt(np.maximum(square - grey**2, np.float32(0)))
    noise = np.float32(_PER_DIFFERENCE) * differences
    return Blocks(grey.ravel(), spread.ravel(), noise.ravel())[chosen.ravel()]


def blocks_of_all(images: Sequence[NDArray[np.float32]]) -> list[Blocks]:
    """Measure the blocks of several images (H, W)."""
    found = [Blocks(*np.empty((3, 0), np.float32))] * len(images)

    def work(start: int, stop: int) -> None:
        found[start:stop] = [blocks_of(image) for image in images[start:stop]]

    run_in_bands(work, len(images))
    return found


def noise_grey(image: NDArray[np.float32]) -> float:
    """White noise of one image (H, W), 1 sigma in its own grey levels."""
    return blocks_of(image).quiet_noise


@kernel()
def _measure(
    image: NDArray[np.float32],
    block: int,
    differences: NDArray[np.float32],
    grey: NDArray[np.float32],
    square: NDArray[np.float32],
    low: NDArray[np.float32],
    high: NDArray[np.float32],
) -> None:
    """Fill in what `blocks_of` asks for.

    Of each block: mean size of the second difference in both directions, mean of the grey value and
    of its square, lowest and highest grey value.
    """
    rows, columns = differences.shape
    width = columns * block
    two, four = np.float32(2), np.float32(4)
    count = np.float32(block * block)
    sums = np.empty((5, width), np.float32)
    for i in range(rows):
        sums[:3] = np.float32(0)
        sums[3] = np.float32(np.inf)
        sums[4] = np.float32(-np.inf)
        for v in range(i * block, (i + 1) * block):
            above, here, below = image[v], image[v + 1], image[v + 2]
            left, middle, right = here[:width], here[1 : width + 1], here[2 : width + 2]
            al, am, ar = above[:width], above[1 : width + 1], above[2 : width + 2]
            bl, bm, br = below[:width], below[1 : width + 1], below[2 : width + 2]
            size, total, squares, least, most = sums[0], sums[1], sums[2], sums[3], sums[4]
            for u in range(width):
                corners = al[u] + ar[u] + bl[u] + br[u]
                cross = left[u] + right[u] + am[u] + bm[u]
                size[u] += abs(corners - two * cross + four * middle[u])
                total[u] += middle[u]
                squares[u] += middle[u] * middle[u]
                least[u] = min(least[u], middle[u])
                most[u] = max(most[u], middle[u])
        for j in range(columns):
            size_of_all = total_of_all = squares_of_all = np.float32(0)
            lowest, highest = sums[3, j * block], sums[4, j * block]
            for u in range(j * block, (j + 1) * block):
                size_of_all += sums[0, u]
                total_of_all += sums[1, u]
                squares_of_all += sums[2, u]
                lowest, highest = min(lowest, sums[3, u]), max(highest, sums[4, u])
            differences[i, j] = size_of_all / count
            grey[i, j] = total_of_all / count
            square[i, j] = squares_of_all / count
            low[i, j], high[i, j] = lowest, highest
