"""Sub-pixel corners: fit two crossing blurred edges to the pixels around each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Float = NDArray[np.float64]

_PARAMETERS = 7  # x, y, two edge angles, blur, middle grey, half contrast
_STEPS = 6
_SETTLED_PX = 2e-3
"""Changes shrink quadratically: after this one nothing is left to gain."""
_START_BLUR_PX = 1.0
_LARGEST_CHANGE = np.array([1.0, 1.0, 0.3, 0.3, 0.6, np.inf, np.inf])
_ROOM_PX = 2.0
"""Kept between the window and the next edge, for its blur."""
_SMALLEST_RADIUS_PX = 2.5
_LARGEST_RADIUS_PX = 7.0
_MIN_BLUR_PX = 0.3


@dataclass(frozen=True, slots=True)
class CrossingFit:
    """N fitted corners; NaN positions where the fit ran away or the window leaves the picture."""

    xy_px: Float
    """(N, 2)."""
    sigma_px: Float
    """(N,) 1 sigma per coordinate, from the residual."""
    blur_px: Float
    """(N,) sigma of the edge profile."""
    contrast: Float
    """(N,) white minus black, grey levels; negative where the axes enclose a dark quadrant."""


def fit_crossings(
    picture: NDArray[np.float32], xy_px: Float, axes: Float, clear_px: Float
) -> CrossingFit:
    """Fit `grey = middle + half * erf(edge 1) * erf(edge 2)` around every start by Gauss-Newton.

    A crossing of two straight edges is point-symmetric and stays one under perspective, and the
    weights are centred on the estimate, so the position carries no bias from the pixel grid.

    Args:
        picture: (H, W) grey.
        xy_px: (N, 2) starts, good to about 1.5 px.
        axes: (N, 2, 2) unit vectors along the two edges; their order and signs fix
            nothing but the sign of the contrast.
        clear_px: (N,) distance to the nearest other edge.
    """
    last = np.array(picture.shape[::-1]) - 1
    base = np.round(xy_px).astype(np.intp)
    border_px = np.minimum(base, last - base).min(axis=1, initial=last.max())
    inside = border_px > _SMALLEST_RADIUS_PX
    room_px = np.minimum(clear_px - _ROOM_PX, border_px - 0.5)
    radius = np.clip(room_px, _SMALLEST_RADIUS_PX, _LARGEST_RADIUS_PX)
    offset = _disc(int(np.ceil(radius.max(initial=_SMALLEST_RADIUS_PX))) + 1)
    # Pixels that the border moves have no weight.
    column, row = np.clip(base[:, None] + offset, 0, last).transpose(2, 0, 1)
    window = _Window(picture[row, column], offset.astype(np.float32), radius)

    value = np.zeros((len(xy_px), _PARAMETERS))
    value[:, :2] = xy_px - base
    value[:, 2:4] = np.arctan2(axes[..., 1], axes[..., 0])
    value[:, 4] = _START_BLUR_PX
    value[:, 5:] = window.levels(value)
    sigma_px = np.full(len(value), np.nan)
    for _ in range(_STEPS):
        change, sigma_px = window.step(value)
        value = value + np.clip(change, -_LARGEST_CHANGE, _LARGEST_CHANGE)
        value[:, 4] = np.maximum(value[:, 4], _MIN_BLUR_PX)
        if np.abs(change[:, :2]).max(initial=0) < _SETTLED_PX:
            break
    found = base + value[:, :2]
    moved = np.abs(found - xy_px).max(axis=1, initial=0)
    good = inside & (moved < np.maximum(2.0, 0.3 * clear_px)) & np.isfinite(value).all(axis=1)
    return CrossingFit(
        np.where(good[:, None], found, np.nan),
        np.where(good, sigma_px, np.nan),
        value[:, 4],
        2 * value[:, 6],
    )


def _disc(reach: int) -> NDArray[np.intp]:
    """(P, 2) offsets (x, y) of the pixels within a radius."""
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    near = np.hypot(x, y) <= reach
    return np.stack([x[near], y[near]], axis=-1)


@dataclass(frozen=True, slots=True)
class _Window:
    """The P pixels around each of N corners."""

    grey: NDArray[np.float32]
    """(N, P)."""
    offset: NDArray[np.float32]
    """(P, 2) from the corner's nearest pixel."""
    radius: Float
    """(N,) px."""

    def weight(self, value: Float) -> NDArray[np.float32]:
        """One inside the radius about the estimate, fading to zero over a pixel."""
        apart = self.offset - value[:, None, :2].astype(np.float32)
        far = np.hypot(apart[..., 0], apart[..., 1])
        return np.clip(self.radius[:, None].astype(np.float32) + np.float32(0.5) - far, 0, 1)

    def levels(self, value: Float) -> Float:
        """(N, 2) middle grey and half contrast by linear least squares."""
        first, second = _edge(self.offset, value, 2), _edge(self.offset, value, 3)
        shape, weight = first.value * second.value, self.weight(value)
        total = weight.sum(axis=1)
        mean_grey = (weight * self.grey).sum(axis=1) / total
        mean_shape = (weight * shape).sum(axis=1) / total
        apart = shape - mean_shape[:, None]
        power = np.maximum((weight * apart**2).sum(axis=1), 1e-6)
        half = (weight * apart * self.grey).sum(axis=1) / power
        return np.stack([mean_grey - half * mean_shape, half], axis=-1).astype(np.float64)

    def step(self, value: Float) -> tuple[Float, Float]:
        """(N, parameters) Gauss-Newton change, and (N,) sigma of the position before it."""
        weight = self.weight(value)
        model, jacobian = _model(self.offset, value)
        residual = self.grey - model
        weighted = jacobian * weight[:, None]
        normal = (weighted @ jacobian.transpose(0, 2, 1)).astype(np.float64)
        scale = np.sqrt(np.maximum(np.einsum("nkk->nk", normal), 1e-12))
        normal = normal / scale[:, :, None] / scale[:, None] + 1e-9 * np.eye(_PARAMETERS)
        inverse = np.linalg.inv(normal)
        wanted = (weighted @ residual[..., None])[..., 0] / scale
        change = (inverse @ wanted[..., None])[..., 0] / scale
        spare = np.maximum(weight.sum(axis=1) - _PARAMETERS, 1)
        variance = (weight * residual**2).sum(axis=1) / spare
        position = np.einsum("nkk->nk", inverse)[:, :2] / scale[:, :2] ** 2
        square = variance * position.mean(axis=1)
        # A singular fit may come out negative: it has no sigma, and is no corner.
        return change, np.sqrt(np.where(square >= 0, square, np.nan))


@dataclass(frozen=True, slots=True)
class _Edge:
    """One edge at the N x P pixels: its profile and where they lie."""

    value: NDArray[np.float32]
    slope: NDArray[np.float32]
    along: NDArray[np.float32]
    across: NDArray[np.float32]
    normal: NDArray[np.float32]


def _edge(offset: NDArray[np.float32], value: Float, which: int) -> _Edge:
    place = value.astype(np.float32)
    angle, blur = place[:, which, None], place[:, 4, None]
    x, y = (offset - place[:, None, :2]).transpose(2, 0, 1)
    normal = np.concatenate([-np.sin(angle), np.cos(angle)], axis=1)
    across = x * normal[:, :1] + y * normal[:, 1:]
    along = x * normal[:, 1:] - y * normal[:, :1]
    scaled = across / (np.float32(np.sqrt(2)) * blur)
    slope = np.float32(np.sqrt(2 / np.pi)) / blur * np.exp(-(scaled**2))
    return _Edge(erf(scaled), slope, along, across, normal)


def _model(
    offset: NDArray[np.float32], value: Float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Grey levels (N, P) and their derivatives (N, parameters, P)."""
    first, second = _edge(offset, value, 2), _edge(offset, value, 3)
    blur, middle, half = value[:, 4:, None].astype(np.float32).transpose(1, 0, 2)
    shape = first.value * second.value
    one, two = half * first.slope * second.value, half * second.slope * first.value
    jacobian = np.stack(
        [
            -one * first.normal[:, :1] - two * second.normal[:, :1],
            -one * first.normal[:, 1:] - two * second.normal[:, 1:],
            -one * first.along,
            -two * second.along,
            -(one * first.across + two * second.across) / blur,
            np.ones_like(one),
            shape,
        ],
        axis=1,
    )
    return middle + half * shape, jacobian
