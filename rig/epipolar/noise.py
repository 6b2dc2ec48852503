"""What the images themselves say about their noise, contrast, gains and offsets.

Every grey scale of the estimator (truncation, robust scales, prefilter) comes from here.
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.kernel import kernel

_BLOCK_PX = 16
_QUIET_SHARE = 0.1
# Median ratio of the quiet-share quantile to the mean over blocks of pure white noise, 16 x 16 px.
_QUIET_RATIO = 0.885


def noise_grey(image: NDArray[np.float32]) -> float:
    """White noise of one image, 1 sigma in its own grey levels.

    The second difference in both directions kills planes and straight ramps (J. Immerkaer, "Fast
    noise variance estimation", CVIU 64, 1996); its mean size is taken in the quietest tenth of the
    blocks, so that texture does not count as noise. Blocks without any variation are clipped or
    synthetic, and say nothing.
    """
    height, width = image.shape
    block = min(_BLOCK_PX, height - 2, width - 2)
    if block < 1:
        return 0.0
    means = np.empty(((height - 2) // block, (width - 2) // block), np.float32)
    _second_differences(image, block, means)
    means = means[means > 0]
    if not len(means):
        return 0.0
    quiet = float(np.quantile(means, _QUIET_SHARE))
    return float(np.sqrt(np.pi / 2) / 6 / _QUIET_RATIO * quiet)


@kernel()
def _second_differences(image: NDArray[np.float32], block: int, means: NDArray[np.float32]) -> None:
    """Mean size of the second difference in both directions, of each block."""
    rows, columns = means.shape
    width = columns * block
    two, four = np.float32(2), np.float32(4)
    sums = np.empty(width, np.float32)
    for i in range(rows):
        sums[:] = np.float32(0)
        for v in range(i * block, (i + 1) * block):
            above, here, below = image[v], image[v + 1], image[v + 2]
            left, middle, right = here[:width], here[1 : width + 1], here[2 : width + 2]
            al, am, ar = above[:width], above[1 : width + 1], above[2 : width + 2]
            bl, bm, br = below[:width], below[1 : width + 1], below[2 : width + 2]
            for u in range(width):
                corners = al[u] + ar[u] + bl[u] + br[u]
                cross = left[u] + right[u] + am[u] + bm[u]
                sums[u] += abs(corners - two * cross + four * middle[u])
        for j in range(columns):
            total = np.float32(0)
            for u in range(j * block, (j + 1) * block):
                total += sums[u]
            means[i, j] = total / np.float32(block * block)
