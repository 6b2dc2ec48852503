"""Saddle points: where two dark and two bright quadrants of a picture meet."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel

Picture = NDArray[np.float32]

MAX_SADDLES = 400
"""No more are looked at, so that noise costs no more time than a board."""
_RING = 16
_TURN: Float = np.arange(_RING, dtype=np.float64) * (2 * np.pi / _RING)
_ROUNDING = 1.2e-4
"""Of the brightest pixel: what single precision may make of a second derivative that is none, the
geometric mean of it and of the largest one."""
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
    least = (_ROUNDING * float(smooth.max())) ** 2
    border = int(np.ceil(ring_px)) + 1
    row, column = _strongest(_strength(smooth, border), border=border, least=least)
    hessian = _hessian(smooth, row, column)
    xy_px = np.stack([column, row], axis=-1) + _beside_pixel(smooth, row, column, hessian)
    ring = bilinear(smooth, xy_px[:, None] + ring_px * _unit(_TURN))
    kept, contrast = _ring_test(ring)
    axes, bright = _directions(ring[kept])
    return Saddles(xy_px[kept], axes, bright, contrast[kept])


@kernel()
def _strength(smooth: Picture, border: int) -> Picture:
    """Less the determinant of the Hessian, and zero nearer to the border of the picture."""
    strength = np.zeros_like(smooth)
    two, quarter = np.float32(2), np.float32(0.25)
    for row in range(border, smooth.shape[0] - border):
        above, here, below = smooth[row - 1], smooth[row], smooth[row + 1]
        for column in range(border, smooth.shape[1] - border):
            xx = here[column - 1] - two * here[column] + here[column + 1]
            yy = above[column] - two * here[column] + below[column]
            xy = above[column - 1] - above[column + 1] - below[column - 1] + below[column + 1]
            xy *= quarter
            strength[row, column] = xy * xy - xx * yy
    return strength


@kernel()
def _peaks(strength: Picture, border: int, least: float) -> NDArray[np.intp]:
    """(K, 2) rows and columns, so far from the border of the picture (two pixels at least).

    Of values above `least` that no other one within two pixels exceeds.
    """
    rows, columns = strength.shape
    found = np.empty((len(strength) * columns // 4 + columns, 2), np.intp)
    above_all = np.zeros(columns, np.bool_)
    count = 0
    for row in range(border, rows - border):
        above, here, below = strength[row - 1], strength[row], strength[row + 1]
        for column in range(border, columns - border):
            value = here[column]
            # Without branches: several at a time.
            above_all[column] = (
                (value > least)
                & (value >= here[column - 1])
                & (value >= here[column + 1])
                & (value >= above[column])
                & (value >= below[column])
            )
        for column in range(border, columns - border):
            if not above_all[column]:
                continue
            if _is_highest(strength, row, column):
                found[count, 0], found[count, 1] = row, column
                count += 1
    return found[:count]


@kernel()
def _is_highest(strength: Picture, row: int, column: int) -> bool:
    """Whether no value within two pixels is larger."""
    value = strength[row, column]
    for y in range(row - 2, row + 3):
        for x in range(column - 2, column + 3):
            if strength[y, x] > value:
                return False
    return True


def _strongest(
    strength: Picture, *, border: int, least: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the local maxima worth a look, strongest first."""
    row, column = _peaks(strength, border, least).T
    values = strength[row, column]
    order = np.argsort(-values, kind="stable")[:MAX_SADDLES]
    if order.size:
        strong = values[order[min(20, order.size - 1)]]
        order = order[values[order] > _WEAKEST * strong]
    return row[order], column[order]


def _hessian(smooth: Picture, row: NDArray[np.intp], column: NDArray[np.intp]) -> Float:
    """(3, N) second derivatives xx, xy, yy."""
    near = [
        [smooth[row + y, column + x].astype(np.float64) for x in (-1, 0, 1)] for y in (-1, 0, 1)
    ]
    (a, b, c), (d, e, f), (g, h, i) = near
    return np.stack([d - 2 * e + f, (a - c - g + i) / 4, b - 2 * e + h])


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


def _directions(ring: Float) -> tuple[Float, Float]:
    """Axes (N, 2, 2) along the edges, and the doubled direction (N, 2) into a bright quadrant.

    Edges cross the ring where its grey levels pass their middle. Seen from the middle of the ring
    this holds at every angle between the edges; the Hessian does so only without blur.
    """
    above = ring > _middle(ring)
    following = np.roll(above, -1, axis=1)
    point, place = np.nonzero(above != following)
    now, then = ring[point, place], np.roll(ring, -1, axis=1)[point, place]
    part = (_middle(ring)[point, 0] - now) / (then - now)
    # Every ring has four crossings: 0 and 2 are the two ends of one edge, 1 and 3 of the other.
    crossing = ((place + part) * (2 * np.pi / _RING)).reshape(-1, 4)
    edges = (crossing[:, :2] + crossing[:, 2:] - np.pi) / 2
    first_is_bright = following[point, place].reshape(-1, 4)[:, 0]
    between = edges.sum(axis=1) / 2 + np.where(first_is_bright, 0.0, np.pi / 2)
    return _unit(edges), _unit(2 * between)


def _ring_test(ring: Float) -> tuple[NDArray[np.bool_], Float]:
    """Which rings (N, R) have four quadrants in turn, and their contrast."""
    contrast = ring.max(axis=1) - ring.min(axis=1)
    above = ring > _middle(ring)
    changes = (above != np.roll(above, 1, axis=1)).sum(axis=1)
    half_turn = ring - np.roll(ring, _RING // 2, axis=1)
    uneven = np.abs(half_turn).mean(axis=1)
    return (changes == 4) & (uneven < 0.35 * contrast) & (contrast > 0), contrast


def _middle(ring: Float) -> Float:
    """(N, 1) between the darkest and the brightest."""
    return ((ring.min(axis=1) + ring.max(axis=1)) / 2)[:, None]


def _unit(angle_rad: Float) -> Float:
    """Unit vectors (..., 2)."""
    return np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=-1)


def bilinear(picture: Picture, xy_px: Float) -> Float:
    """Sample a picture at (..., 2) positions inside it."""
    return _sample(np.ascontiguousarray(picture), xy_px.reshape(-1, 2)).reshape(xy_px.shape[:-1])


@kernel()
def _sample(picture: Picture, xy_px: Float) -> Float:
    grey = np.empty(len(xy_px))
    for n in range(len(xy_px)):
        grey[n] = grey_at(picture, xy_px[n, 0], xy_px[n, 1])
    return grey


@kernel()
def grey_at(picture: Picture, x_px: float, y_px: float) -> float:
    """The grey level between four pixels."""
    column = min(max(int(x_px), 0), picture.shape[1] - 2)
    row = min(max(int(y_px), 0), picture.shape[0] - 2)
    right, down = x_px - column, y_px - row
    top = picture[row, column] * (1 - right) + picture[row, column + 1] * right
    bottom = picture[row + 1, column] * (1 - right) + picture[row + 1, column + 1] * right
    return top * (1 - down) + bottom * down
