"""What neighbours say of a pixel, brighter, darker or alike: a cost that no light can spoil.

The census transform (R. Zabih and J. Woodfill, "Non-parametric local transforms for computing
visual correspondence", ECCV 1994) with a tolerance, so that noise alone is no difference. It counts
a faint structure for as much as a strong one: right at depth edges, where windows mix two surfaces,
and wrong where the structure is noise. So its cost is weighed by the texture around.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.rank import mean
from rig.epipolar.search.halves import COST_MAX
from rig.epipolar.search.window import Cameras

_RADIUS_PX, _BITS = 2, 24
"""5 x 5 px; two bits of each neighbour, of which a point without any likeness differs in half."""
_SURE_SHARE, _TEXTURE_RADIUS_PX = 1.5, 4
"""Gradient, over the noise, at which the cost counts for half."""


def join_census(
    costs: NDArray[np.uint8],
    images: NDArray[np.float32],
    cameras: Cameras,
    labels_px: NDArray[np.float32],
    noise_levels: float,
    share: float,
) -> None:
    """Let costs (H, L, W) tell by a share how the neighbourhoods differ.

    Args:
        costs: of every slope at every pixel, 0 to `COST_MAX`.
        images: (V, H, W) grey values.
        cameras: where the views stand.
        labels_px: (L,) slopes, px per view step; the views are read at the nearest pixel.
        noise_levels: noise of the grey values, 1 sigma.
        share: of the neighbourhoods in the sum.
    """
    codes, r = np.empty(images.shape, np.uint64), _RADIUS_PX

    def encode(start: int, stop: int) -> None:
        for i in range(start, stop):
            border = cv2.copyMakeBorder(images[i], r, r, r, r, cv2.BORDER_REPLICATE)
            _encode(np.asarray(border, np.float32), np.float32(noise_levels), codes[i])

    run_in_bands(encode, len(images))
    others = np.flatnonzero(np.arange(len(images)) != cameras.reference)
    right, down = (
        np.rint(np.outer(labels_px, steps[others])).astype(np.int64)
        for steps in (cameras.x_steps, cameras.y_steps)
    )
    weight = _weight(images[cameras.reference], cameras, noise_levels)

    def work(start: int, stop: int) -> None:
        plane = np.empty(images.shape[1:], np.float32)
        for label in range(start, stop):
            _differences(codes, cameras.reference, others, right[label], down[label], plane)
            _join(mean(plane, 1), weight, costs[:, label], np.float32(share))

    run_in_bands(work, len(labels_px))


def _weight(
    grey: NDArray[np.float32], cameras: Cameras, noise_levels: float
) -> NDArray[np.float32]:
    """Share of a patch's squared gradients along the lines that is texture, (H, W)."""
    is_row = np.abs(cameras.x_steps).max() >= np.abs(cameras.y_steps).max()
    tilt = cv2.Sobel(grey, cv2.CV_32F, int(is_row), int(not is_row), ksize=1, scale=0.5)
    power = mean(np.square(np.asarray(tilt, np.float32)), _TEXTURE_RADIUS_PX)
    return np.asarray(power / (power + np.float32((_SURE_SHARE * noise_levels) ** 2)), np.float32)


@kernel()
def _encode(padded: NDArray[np.float32], noise: np.float32, codes: NDArray[np.uint64]) -> None:
    """Two bits for every neighbour: darker, and brighter, than the pixel by more than the noise."""
    height, width = codes.shape
    side = 2 * _RADIUS_PX + 1
    one, zero = np.uint64(1), np.uint64(0)
    codes[:] = zero
    for v in range(height):
        here, code = padded[v + _RADIUS_PX, _RADIUS_PX : _RADIUS_PX + width], codes[v]
        for y in range(side):
            for x in range(side):
                if x == _RADIUS_PX and y == _RADIUS_PX:
                    continue
                beside = padded[v + y, x : x + width]
                for u in range(width):
                    darker = one if beside[u] < here[u] - noise else zero
                    brighter = one if beside[u] > here[u] + noise else zero
                    code[u] = (code[u] << np.uint64(2)) | (darker << one) | brighter


@kernel()
def _differences(
    codes: NDArray[np.uint64],
    reference: int,
    others: NDArray[np.int64],
    right: NDArray[np.int64],
    down: NDArray[np.int64],
    plane: NDArray[np.float32],
) -> None:
    """Fill in how many bits differ from the reference, mean of the views that show the pixel."""
    height, width = plane.shape
    pairs, fours, bytes_ = (
        np.uint64(0x5555555555555555),
        np.uint64(0x3333333333333333),
        np.uint64(0x0F0F0F0F0F0F0F0F),
    )
    one, two, four = np.uint64(1), np.uint64(2), np.uint64(4)
    ones, top = np.uint64(0x0101010101010101), np.uint64(56)
    seen = np.empty(width, np.float32)
    for v in range(height):
        total = plane[v]
        total[:] = np.float32(0)
        seen[:] = np.float32(0)
        for k in range(len(others)):
            row = v - down[k]
            first, last = max(0, right[k]), min(width, width + right[k])
            if not 0 <= row < height or last <= first:
                continue
            here = codes[reference, v, first:last]
            there = codes[others[k], row, first - right[k] : last - right[k]]
            sums, count = total[first:last], seen[first:last]
            for u in range(last - first):
                bits = here[u] ^ there[u]
                bits = bits - ((bits >> one) & pairs)
                bits = (bits & fours) + ((bits >> two) & fours)
                bits = (bits + (bits >> four)) & bytes_
                sums[u] += np.float32((bits * ones) >> top)
                count[u] += np.float32(1)
        for u in range(width):
            total[u] = total[u] / seen[u] if seen[u] > 0 else np.float32(_BITS)


@kernel()
def _join(
    plane: NDArray[np.float32],
    weight: NDArray[np.float32],
    costs: NDArray[np.uint8],
    share: np.float32,
) -> None:
    height, width = plane.shape
    scale, limit, rest = np.float32(COST_MAX / _BITS), np.float32(COST_MAX), np.float32(1) - share
    for v in range(height):
        own, counts, bits = costs[v], weight[v], plane[v]
        for u in range(width):
            differs = counts[u] * min(scale * bits[u], limit)
            own[u] = np.uint8(rest * np.float32(own[u]) + share * differs)
