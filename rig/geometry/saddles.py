"""Saddle points: where two dark and two bright quadrants of a picture meet."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Picture = NDArray[np.float32]

MAX_SADDLES = 400
"""No more are looked at, so that noise costs no more time than a board."""
_RING = 16
_WEAKEST = 0.01
"""Responses below this share of the strongest ones are not looked at."""


@dataclass(frozen=True, slots=True)
class Saddles:
    """N saddle points, strongest first."""

    xy_px: Float
    """(N, 2)."""
    axes: Float
    """(N, 2, 2) unit vectors along the two edges that cross."""
    bright: Float
    """(N, 2) unit vector into one of the bright quadrants, doubled in angle (cos 2t, sin 2t)."""
    contrast: Float
    """(N,) bright minus dark around the point, in grey levels."""

    def __len__(self) -> int:
        return len(self.xy_px)


def find_saddles(picture: Picture, *, smooth_px: float, ring_px: float) -> Saddles:
    """Find X-shaped crossings by the determinant of the Hessian and a ring of samples.

    The Hessian's determinant is most negative at a saddle (Chen and Zhang, "A new sub-pixel
    detector for X-corners in camera calibration targets", WSCG 2005); of its extrema those stay
    whose ring shows bright, dark, bright, dark and looks alike after half a turn.

    Args:
        picture: (H, W) grey.
        smooth_px: sigma of the Gaussian before the second derivatives.
        ring_px: radius of the ring; squares must be larger.
    """
    smooth = cv2.GaussianBlur(picture, (0, 0), smooth_px).astype(np.float32, copy=False)
    second = np.array([[1.0, -2.0, 1.0]], np.float32)
    xx = cv2.filter2D(smooth, cv2.CV_32F, second)
    yy = cv2.filter2D(smooth, cv2.CV_32F, second.T)
    slope = np.array([-0.5, 0.0, 0.5], np.float32)
    xy = cv2.sepFilter2D(smooth, cv2.CV_32F, slope, slope)
    strength = xy * xy - xx * yy
    row, column = _strongest(strength, border=int(np.ceil(ring_px)) + 1)
    hessian = np.stack([xx[row, column], xy[row, column], yy[row, column]]).astype(np.float64)
    xy_px = np.stack([column, row], axis=-1) + _beside_pixel(smooth, row, column, hessian)
    # Where edges cross at a sharp angle the Hessian turns within a pixel.
    fields = (np.asarray(field, np.float32) for field in (xx, xy, yy))
    axes, bright = _directions(np.stack([bilinear(field, xy_px) for field in fields]))
    kept, contrast = _ring_test(smooth, xy_px, ring_px)
    return Saddles(xy_px[kept], axes[kept], bright[kept], contrast[kept])


def _strongest(strength: Picture, *, border: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the local maxima worth a look, strongest first."""
    inner = strength[border:-border, border:-border]
    if inner.size == 0:
        none = np.empty(0, np.intp)
        return none, none
    peak = inner == cv2.dilate(inner, np.ones((5, 5), np.uint8))
    row, column = np.divmod(np.flatnonzero(peak & (inner > 0)), inner.shape[1])
    values = inner[row, column]
    order = np.argsort(-values, kind="stable")[:MAX_SADDLES]
    if order.size:
        strong = values[order[min(20, order.size - 1)]]
        order = order[values[order] > _WEAKEST * strong]
    return row[order] + border, column[order] + border


def _beside_pixel(
    smooth: Picture, row: NDArray[np.intp], column: NDArray[np.intp], hessian: Float
) -> Float:
    """(N, 2) from the pixel to where the gradient vanishes, within a pixel."""
    along_x = (smooth[row, column + 1] - smooth[row, column - 1]) / 2
    along_y = (smooth[row + 1, column] - smooth[row - 1, column]) / 2
    xx, xy, yy = hessian
    determinant = xx * yy - xy * xy
    x, y = xy * along_y - yy * along_x, xy * along_x - xx * along_y
    return np.clip(np.stack([x, y], axis=-1) / determinant[:, None], -1, 1)


def _directions(hessian: Float) -> tuple[Float, Float]:
    """Where the quadratic form of the Hessian (xx, xy, yy) vanishes, and where it rises most."""
    xx, xy, yy = hessian
    mean, half = (xx + yy) / 2, (xx - yy) / 2
    radius = np.maximum(np.hypot(half, xy), 1e-12)
    bright = np.stack([half, xy], axis=-1) / radius[:, None]
    angle = 0.5 * np.arctan2(xy, half)
    # cos(2 (t - angle)) = -mean / radius along an edge.
    aside = 0.5 * np.arccos(np.clip(-mean / radius, -1, 1))
    edges = np.stack([angle + aside, angle - aside], axis=-1)
    return np.stack([np.cos(edges), np.sin(edges)], axis=-1), bright


def _ring_test(smooth: Picture, xy_px: Float, ring_px: float) -> tuple[NDArray[np.bool_], Float]:
    """Which points have four quadrants in turn, and their contrast."""
    turn = np.arange(_RING) * (2 * np.pi / _RING)
    at = xy_px[:, None] + ring_px * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    ring = bilinear(smooth, at)
    low, high = ring.min(axis=1), ring.max(axis=1)
    contrast = high - low
    above = ring > ((low + high) / 2)[:, None]
    changes = (above != np.roll(above, 1, axis=1)).sum(axis=1)
    half_turn = ring - np.roll(ring, _RING // 2, axis=1)
    uneven = np.abs(half_turn).mean(axis=1)
    return (changes == 4) & (uneven < 0.35 * contrast) & (contrast > 0), contrast


def bilinear(picture: Picture, xy_px: Float) -> Float:
    """Sample a picture at (..., 2) positions inside it."""
    x, y = xy_px[..., 0], xy_px[..., 1]
    column = np.clip(x.astype(np.intp), 0, picture.shape[1] - 2)
    row = np.clip(y.astype(np.intp), 0, picture.shape[0] - 2)
    right, down = x - column, y - row
    top = picture[row, column] * (1 - right) + picture[row, column + 1] * right
    bottom = picture[row + 1, column] * (1 - right) + picture[row + 1, column + 1] * right
    return top * (1 - down) + bottom * down
