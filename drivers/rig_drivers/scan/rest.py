"""Whether the scene was at rest: two takes of the reference, compared block by block."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.files import write_bytes
from rig.frames import Frame
from rig_drivers.scan.brightness import BLOCK_PX, relative_light

Grey = NDArray[np.float32]

_EXCESS = 2.5
"""A block has moved if its squared difference is so many times what noise makes of it. Noise alone
scatters by 9 % in a block of 256 pixels; its estimate, from the smooth quarter of blocks of about
one brightness, is up to a third too small."""
_FEWEST_BLOCKS = 2
"""Neighbours: a single block may be a fly, or chance."""
_LEVEL_BINS = 16
_SAME_LEVELS = 0.5
"""Differences of so many grey levels (of 8 bit) are rounding."""


@dataclass(frozen=True, slots=True)
class Motion:
    """The largest part of a picture that is not what it was."""

    region_px: tuple[int, int, int, int]
    """Left, top, right and bottom."""
    change_levels: float
    """Root mean square change in it, grey levels."""


def find_motion(before: Frame, after: Frame, tolerance_px: float) -> Motion | None:
    """Return what moved between two pictures from one place; None where nothing did.

    A block has moved where its difference, once the change of light is taken out, is more than
    noise and more than a shift of its own texture by `tolerance_px` makes. What noise is the
    pictures themselves tell: the second differences in the smoothest blocks of each brightness.

    Saturated pixels tell no change.

    Args:
        before: a take of the reference.
        after: a later one.
        tolerance_px: motion that is allowed, as a carriage that does not quite come back makes.
    """
    first = before.image.astype(np.float32)
    last = relative_light(after, before).taken_out(after.image.astype(np.float32))
    saturated = (before.image >= before.full_scale) | (after.image >= after.full_scale)
    change = _means(np.where(saturated, np.float32(0.0), np.square(last - first)))
    noise = _noise_levels2(first) + _noise_levels2(last)
    across = cv2.Sobel(first, cv2.CV_32F, 1, 0, scale=0.125)
    down = cv2.Sobel(first, cv2.CV_32F, 0, 1, scale=0.125)
    texture = _means(np.square(across) + np.square(down))
    rounding = (_SAME_LEVELS * before.full_scale / 255.0) ** 2
    moved = change > _EXCESS * noise + tolerance_px**2 * texture + rounding
    return _largest(moved, change)


def show_motion(frame: Frame, motion: Motion, path: Path) -> None:
    """Write a picture of the scene with a frame around what moved.

    Raises:
        StoreError: it cannot be written.
    """
    grey = np.rint(frame.image.astype(np.float32) * (255.0 / frame.full_scale)).astype(np.uint8)
    shown = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
    left, top, right, bottom = motion.region_px
    cv2.rectangle(shown, (left, top), (right - 1, bottom - 1), (0, 0, 255), 2)
    _, content = cv2.imencode(".png", shown)
    write_bytes(path, content.tobytes())


def _largest(moved: NDArray[np.bool_], change: NDArray[np.float64]) -> Motion | None:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(moved.astype(np.uint8), connectivity=8)
    sizes = stats[1:, cv2.CC_STAT_AREA]
    if not len(sizes) or sizes.max() < _FEWEST_BLOCKS:
        return None
    label = 1 + int(np.argmax(sizes))
    left, top, width, height = (int(n) * BLOCK_PX for n in stats[label, :4])
    levels = float(np.sqrt(np.mean(change[labels == label])))
    return Motion((left, top, left + width, top + height), levels)


def _means(image: Grey) -> NDArray[np.float64]:
    height, width = image.shape[0] // BLOCK_PX, image.shape[1] // BLOCK_PX
    whole = image[: height * BLOCK_PX, : width * BLOCK_PX]
    small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float64)


def _noise_levels2(image: Grey) -> NDArray[np.float64]:
    """Variance of the noise in every block, from the smoothest blocks of like brightness.

    J. Immerkaer, "Fast noise variance estimation", Computer Vision and Image Understanding 64(2),
    1996: a difference of two Laplacians leaves of smooth surfaces nothing.
    """
    kernel = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32) / 6.0
    variance, level = _means(np.square(cv2.filter2D(image, cv2.CV_32F, kernel))), _means(image)
    edges = np.quantile(level, np.linspace(0.0, 1.0, _LEVEL_BINS + 1)[1:-1])
    bins = np.searchsorted(edges, level)
    noise = np.empty_like(variance)
    for number in range(_LEVEL_BINS):
        own = bins == number
        if own.any():
            noise[own] = np.quantile(variance[own], 0.25)
    return noise
