"""Sub-pixel corners: fit two crossing blurred edges to the pixels around each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Float = NDArray[np.float64]

_PARAMETERS = 7  # x, y, two edge angles, blur, middle grey, half contrast
_STEPS = 5
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
    count = len(xy_px)
    radius = np.clip(clear_px - 2.0, _SMALLEST_RADIUS_PX, _LARGEST_RADIUS_PX)
    reach = int(np.ceil(radius.max(initial=_SMALLEST_RADIUS_PX))) + 2
    offset = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1)[::-1].T
    base = np.round(xy_px).astype(np.intp)
    height, width = picture.shape
    x, y = base.T
    inside = (x >= reach) & (x < width - reach) & (y >= reach) & (y < height - reach)
    base_in = np.where(inside[:, None], base, reach)
    pixel = base_in[:, None] + offset
    grey = picture[pixel[..., 1] % height, pixel[..., 0] % width].astype(np.float64)

    value = np.zeros((count, _PARAMETERS))
    value[:, :2] = xy_px - base
    value[:, 2:4] = np.arctan2(axes[..., 1], axes[..., 0])
    value[:, 4] = 1.0
    sigma_px = np.full(count, np.nan)
    for step in range(_STEPS):
        weight = np.clip(radius[:, None] + 0.5 - _distance(offset, value), 0, 1)
        first, second = _edges(offset, value)
        shape = first.value * second.value
        if step < 2:
            # The grey levels are linear: solve them outright before the rest follows.
            value[:, 5:] = _levels(grey, shape, weight)
        jacobian = _jacobian(first, second, value)
        residual = grey - value[:, 5, None] - value[:, 6, None] * shape
        weighted = jacobian * weight[:, None]
        normal = weighted @ jacobian.transpose(0, 2, 1)
        scale = np.sqrt(np.maximum(np.einsum("nkk->nk", normal), 1e-12))
        normal = normal / scale[:, :, None] / scale[:, None] + 1e-9 * np.eye(_PARAMETERS)
        wanted = np.einsum("nkp,np->nk", weighted, residual) / scale
        change = np.linalg.solve(normal, wanted[..., None])[..., 0] / scale
        change[:, :2] = np.clip(change[:, :2], -1, 1)
        change[:, 2:4] = np.clip(change[:, 2:4], -0.3, 0.3)
        change[:, 4] = np.clip(change[:, 4], -0.5, 0.7)
        value = value + change
        value[:, 4] = np.maximum(value[:, 4], _MIN_BLUR_PX)
        spare = np.maximum(weight.sum(axis=1) - _PARAMETERS, 1)
        variance = (weight * residual**2).sum(axis=1) / spare
        position = np.einsum("nkk->nk", np.linalg.inv(normal))[:, :2] / scale[:, :2] ** 2
        sigma_px = np.sqrt(variance * position.mean(axis=1))
    moved = np.abs(base + value[:, :2] - xy_px).max(axis=1, initial=0)
    good = inside & (moved < np.maximum(2.0, 0.3 * clear_px)) & np.isfinite(value).all(axis=1)
    return CrossingFit(
        np.where(good[:, None], base + value[:, :2], np.nan),
        np.where(good, sigma_px, np.nan),
        value[:, 4],
        2 * value[:, 6],
    )


@dataclass(frozen=True, slots=True)
class _Edge:
    value: Float
    slope: Float
    along: Float
    across: Float
    normal: Float


def _distance(offset: NDArray[np.intp], value: Float) -> Float:
    apart = offset[None] - value[:, None, :2]
    return np.hypot(apart[..., 0], apart[..., 1])


def _edges(offset: NDArray[np.intp], value: Float) -> tuple[_Edge, _Edge]:
    return _edge(offset, value, 2), _edge(offset, value, 3)


def _edge(offset: NDArray[np.intp], value: Float, which: int) -> _Edge:
    angle, blur = value[:, which, None], value[:, 4, None]
    x, y = (offset[None] - value[:, None, :2]).transpose(2, 0, 1)
    normal = np.concatenate([-np.sin(angle), np.cos(angle)], axis=1)
    across = x * normal[:, :1] + y * normal[:, 1:]
    along = x * normal[:, 1:] - y * normal[:, :1]
    scaled = across / (np.sqrt(2) * blur)
    slope = np.sqrt(2 / np.pi) / blur * np.exp(-(scaled**2))
    return _Edge(erf(scaled), slope, along, across, normal)


def _levels(grey: Float, shape: Float, weight: Float) -> Float:
    total = weight.sum(axis=1)
    mean_grey = (weight * grey).sum(axis=1) / total
    mean_shape = (weight * shape).sum(axis=1) / total
    apart = shape - mean_shape[:, None]
    half = (weight * apart * grey).sum(axis=1) / np.maximum((weight * apart**2).sum(axis=1), 1e-9)
    return np.stack([mean_grey - half * mean_shape, half], axis=-1)


def _jacobian(first: _Edge, second: _Edge, value: Float) -> Float:
    """(N, parameters, pixels) derivatives of the model."""
    half, blur = value[:, 6, None], value[:, 4, None]
    one, two = half * first.slope * second.value, half * second.slope * first.value
    return np.stack(
        [
            -one * first.normal[:, :1] - two * second.normal[:, :1],
            -one * first.normal[:, 1:] - two * second.normal[:, 1:],
            -one * first.along,
            -two * second.along,
            -(one * first.across + two * second.across) / blur,
            np.ones_like(one),
            first.value * second.value,
        ],
        axis=1,
    )
