"""What the images themselves say about their noise, contrast, gains and offsets.

Every grey scale of the estimator (truncation, robust scales, prefilter) comes from here.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

_MASK = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
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
    second = np.abs(cv2.filter2D(image, cv2.CV_32F, _MASK)[1:-1, 1:-1])
    rows, columns = (size // _BLOCK_PX * _BLOCK_PX for size in second.shape)
    if not rows or not columns:
        return float(np.sqrt(np.pi / 2) / 6 * second.mean())
    blocks = second[:rows, :columns].reshape(rows // _BLOCK_PX, _BLOCK_PX, -1, _BLOCK_PX)
    means = blocks.mean(axis=(1, 3)).ravel()
    means = means[means > 0]
    if not len(means):
        return 0.0
    quiet = float(np.quantile(means, _QUIET_SHARE))
    return float(np.sqrt(np.pi / 2) / 6 / _QUIET_RATIO * quiet)
