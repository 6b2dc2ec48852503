"""Micro-images in a white picture, one by one, to a part of a pixel."""

import math
from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel

_BLUR = 0.22
"""Sigma of the blur before the peaks, in spacings: what the eye of the micro-image needs to become
one hill, and no more, or neighbours would pull at it."""
_AROUND = 1.5
"""Sigma of what counts as the picture around a micro-image, in spacings."""
_APART = 0.6
"""Peaks nearer than this, in spacings, are one micro-image."""
_ABOVE_AROUND = 1.03
"""A micro-image is so much brighter than the picture around it; a gap or a dead lenslet is not."""
_WINDOW = 0.52
"""Radius of the window that a centre is measured in, in spacings."""
_STEPS = 12
_BORDER = 0.75
"""Micro-images nearer to the border than this, in spacings, are cut by it."""


@dataclass(frozen=True, slots=True, eq=False)
class Spots:
    """Micro-images that were seen."""

    centre_px: Float
    """(N, 2) columns and rows."""
    light: Float
    """(N,) blurred light at the peak."""


def find_spots(white: NDArray[np.float32], spacing_px: float) -> Spots:
    """Return the micro-images of a white picture (H, W): where their light balances."""
    around = _blurred(white, _AROUND * spacing_px)
    even = (white / np.maximum(around, np.float32(1e-3) * around.max())).astype(np.float32)
    hills = _blurred(even, _BLUR * spacing_px)
    width = 2 * round(_APART * spacing_px / 2.0) + 1
    top = cv2.dilate(hills, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width)))
    is_peak = (hills == top) & (hills > _ABOVE_AROUND)
    border = max(round(_BORDER * spacing_px), 1)
    is_peak[:border] = is_peak[-border:] = False
    is_peak[:, :border] = is_peak[:, -border:] = False
    y, x = np.nonzero(is_peak)
    centre_px = np.stack([x, y], axis=-1).astype(np.float64)
    settled = np.zeros(len(centre_px), np.bool_)
    _settle(white, centre_px, _WINDOW * spacing_px, settled)
    light = (hills * around)[y, x].astype(np.float64)
    return Spots(centre_px[settled], light[settled])


def _blurred(picture: NDArray[np.float32], sigma_px: float) -> NDArray[np.float32]:
    blurred = cv2.GaussianBlur(picture, (0, 0), sigma_px, borderType=cv2.BORDER_REFLECT)
    return cast("NDArray[np.float32]", blurred)


@kernel()
def _settle(
    white: NDArray[np.float32], centre_px: Float, radius_px: float, settled: NDArray[np.bool_]
) -> None:
    """Move every centre to where the light in a round window around it balances, by Newton.

    The window falls off smoothly, so that it does not matter which pixels lie inside it, and ends
    before the neighbours: neither their light nor their absence pulls.
    """
    height, width = white.shape
    for n in range(centre_px.shape[0]):
        x, y = centre_px[n, 0], centre_px[n, 1]
        for _ in range(_STEPS):
            fx = fy = xx = xy = yy = 0.0
            for row in range(math.ceil(y - radius_px), math.floor(y + radius_px) + 1):
                for column in range(math.ceil(x - radius_px), math.floor(x + radius_px) + 1):
                    if row < 0 or column < 0 or row >= height or column >= width:
                        continue
                    dx, dy = column - x, row - y
                    rest = 1.0 - (dx * dx + dy * dy) / (radius_px * radius_px)
                    if rest <= 0.0:
                        continue
                    light = np.float64(white[row, column])
                    near = light * rest
                    fx += near * dx
                    fy += near * dy
                    turn = 2.0 * light / (radius_px * radius_px)
                    xx += near - turn * dx * dx
                    yy += near - turn * dy * dy
                    xy -= turn * dx * dy
            bend = xx * yy - xy * xy
            if xx + yy <= 0.0 or bend <= 0.0:
                break
            step_x, step_y = (yy * fx - xy * fy) / bend, (xx * fy - xy * fx) / bend
            x += step_x
            y += step_y
            away = math.hypot(x - centre_px[n, 0], y - centre_px[n, 1])
            if away > radius_px / 2.0:
                break
            if math.hypot(step_x, step_y) < 1e-4:
                settled[n] = True
                break
        centre_px[n, 0], centre_px[n, 1] = x, y
