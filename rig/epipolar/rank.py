"""Lowest, highest and middle slope of a neighbourhood, and its mean (OpenCV's filters, typed)."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel

Map = NDArray[np.float32]

_BAND_ROWS = 50


def lowest(values: Map, radius_px: int) -> Map:
    """Minimum over a square window, (H, W)."""
    return _by_rows(values, radius_px, lambda part: cv2.erode(part, _square(radius_px)))


def highest(values: Map, radius_px: int) -> Map:
    """Maximum over a square window, (H, W)."""
    return _by_rows(values, radius_px, lambda part: cv2.dilate(part, _square(radius_px)))


def median_of_nine(values: Map) -> Map:
    """Median over 3 x 3 pixels, (H, W)."""
    return _by_rows(values, 1, lambda part: cv2.medianBlur(part, 3))


def jumps(values: Map, over_px: float) -> NDArray[np.bool_]:
    """Whether a value and those beside, above and below it differ by more than this, (H, W)."""
    found, over = np.empty(values.shape, np.bool_), np.float32(over_px)
    run_in_bands(lambda start, stop: _jump(values, over, start, stop, found), len(values))
    return found


@kernel()
def _jump(
    values: NDArray[np.float32],
    over: np.float32,
    start: int,
    stop: int,
    found: NDArray[np.bool_],
) -> None:
    """Spread over a pixel and its four neighbours; outside the picture lies the pixel itself."""
    height, width = values.shape
    row = np.empty(width + 2, np.float32)
    for v in range(start, stop):
        above, here, below = values[max(v - 1, 0)], values[v], values[min(v + 1, height - 1)]
        row[1 : width + 1] = here
        row[0], row[width + 1] = here[0], here[width - 1]
        left, right, out = row[:width], row[2:], found[v]
        for u in range(width):
            low = min(above[u], below[u], here[u], left[u], right[u])
            high = max(above[u], below[u], here[u], left[u], right[u])
            out[u] = high - low > over


def mean(values: Map, radius_px: int) -> Map:
    """Mean over a square window, (H, W)."""
    return mean_over(values, radius_px, radius_px)


def mean_over(values: Map, across: int, down: int) -> Map:
    """Mean over a window that reaches so many pixels to either side, and up and down, (H, W)."""
    size = 2 * across + 1, 2 * down + 1
    return _by_rows(values, down, lambda part: cv2.blur(part, size))


def _by_rows(values: Map, reach: int, work: Callable[[Map], cv2.typing.MatLike]) -> Map:
    """Filter a map (H, W) in bands of rows, each with the rows around that it needs.

    The bands are the same on any number of threads, since sums that run down them round.
    """
    height = len(values)
    result = np.empty_like(values)

    def filter_bands(first: int, last: int) -> None:
        for band in range(first, last):
            start, stop = band * _BAND_ROWS, min((band + 1) * _BAND_ROWS, height)
            above = max(start - reach, 0)
            part = work(values[above : min(stop + reach, height)])
            result[start:stop] = part[start - above : stop - above]

    run_in_bands(filter_bands, -(-height // _BAND_ROWS))
    return result


def departure(values: Map, radius_px: int) -> Map:
    """Spread of a neighbourhood about the plane that its pixels lie on, (H, W).

    A plane's value at a pixel is the mean of those on opposite sides: what a value differs by from
    the mean of two opposite neighbours, at most over the directions and the neighbourhood.
    """
    largest = np.zeros_like(values)
    run_in_bands(lambda start, stop: _depart(values, start, stop, largest), len(values))
    return highest(largest, max(radius_px - 1, 1))


@kernel()
def _depart(
    values: NDArray[np.float32], start: int, stop: int, largest: NDArray[np.float32]
) -> None:
    """Largest difference from the mean of opposite neighbours, twice; 0 at the border."""
    height, width = values.shape
    two = np.float32(2)
    for v in range(max(start, 1), min(stop, height - 1)):
        above, here, below = values[v - 1], values[v], values[v + 1]
        left, middle, right = here[: width - 2], here[1 : width - 1], here[2:]
        al, am, ar = above[: width - 2], above[1 : width - 1], above[2:]
        bl, bm, br = below[: width - 2], below[1 : width - 1], below[2:]
        most = largest[v, 1 : width - 1]
        for u in range(width - 2):
            twice = two * middle[u]
            straight = max(abs(left[u] + right[u] - twice), abs(am[u] + bm[u] - twice))
            slanted = max(abs(al[u] + br[u] - twice), abs(ar[u] + bl[u] - twice))
            most[u] = max(straight, slanted)


def quantile(values: NDArray[np.floating], share: float) -> float:
    """Value that a share of a short list (N,) lies below; between two ranks in proportion.

    What `numpy.quantile` says, in a fraction of the time.
    """
    place = share * (len(values) - 1)
    return float(np.interp(place, np.arange(len(values)), np.sort(values)))


def middle_of(values: NDArray[np.floating]) -> float:
    """Median of some values, (N, ...); of two in the middle, the larger."""
    ranked = np.partition(values, values.size // 2, axis=None)
    return float(ranked[values.size // 2])


def _square(radius_px: int) -> NDArray[np.uint8]:
    return np.ones((2 * radius_px + 1, 2 * radius_px + 1), np.uint8)
