"""Sub-pixel corners: fit two crossing blurred edges to the pixels around each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.crossing import (
    BLUR,
    HALF,
    MIDDLE,
    PARAMETERS,
    Markers,
    Shape,
    Single,
    crossing_model,
    crossing_shape,
)

_STEPS = 6
_SETTLED = np.array([2e-3, 2e-3, 2e-3, 2e-3, 1e-2])
"""Changes of place, angles and blur shrink quadratically: after these nothing is left to gain, and
the residual before them is that of the solution."""
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

    def part(self, which: NDArray[np.bool_]) -> "CrossingFit":
        """Some of the corners."""
        return CrossingFit(
            self.xy_px[which], self.sigma_px[which], self.blur_px[which], self.contrast[which]
        )


def fit_crossings(
    picture: NDArray[np.float32],
    xy_px: Float,
    axes: Float,
    clear_px: Float,
    markers: Markers | None = None,
) -> CrossingFit:
    """Fit the model of `rig.targets.crossing` around every start by Gauss-Newton.

    A crossing of two straight edges is point-symmetric, with or without markers, and stays so under
    perspective; the weights are centred on the estimate, so the position carries no bias from the
    pixel grid. Every corner is fitted as if it were the only one.

    Args:
        picture: (H, W) grey.
        xy_px: (N, 2) starts, good to about 1.5 px.
        axes: (N, 2, 2) unit vectors along the two edges; their order and signs fix
            nothing but the sign of the contrast.
        clear_px: (N,) distance to the nearest edge that the model does not have.
        markers: in the bright quadrants; None for a checkerboard.
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
    window = _Window(picture[row, column], offset.astype(np.float32), radius, markers)

    value = np.zeros((len(xy_px), PARAMETERS))
    value[:, :2] = xy_px - base
    value[:, 2:4] = np.arctan2(axes[..., 1], axes[..., 0])
    value[:, BLUR] = _START_BLUR_PX
    value[:, MIDDLE:] = window.levels(value)
    sigma_px = np.full(len(value), np.nan)
    going = np.arange(len(value))
    for _ in range(_STEPS):
        change, sigma_px[going] = window.step(value[going])
        value[going] += np.clip(change, -_LARGEST_CHANGE, _LARGEST_CHANGE)
        value[:, BLUR] = np.maximum(value[:, BLUR], _MIN_BLUR_PX)
        settled = np.abs(change[:, : len(_SETTLED)]) < _SETTLED
        moving = np.logical_not(settled.all(axis=1))
        if not moving.any():
            break
        if not moving.all():
            going, window = going[moving], window.part(moving)
    found = base + value[:, :2]
    moved = np.abs(found - xy_px).max(axis=1, initial=0)
    good = inside & (moved < np.maximum(2.0, 0.3 * clear_px)) & np.isfinite(value).all(axis=1)
    return CrossingFit(
        np.where(good[:, None], found, np.nan),
        np.where(good, sigma_px, np.nan),
        value[:, BLUR],
        2 * value[:, HALF],
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
    markers: Markers | None

    def part(self, which: NDArray[np.bool_]) -> "_Window":
        """Some of the corners."""
        markers = None if self.markers is None else self.markers.part(which)
        return _Window(self.grey[which], self.offset, self.radius[which], markers)

    def weight(self, value: Float, shape: Shape) -> Single:
        """One inside the radius about the estimate, fading to zero over a pixel."""
        place = value.astype(np.float32)
        x, y = self.offset[:, 0] - place[:, :1], self.offset[:, 1] - place[:, 1:2]
        reach = self.radius[:, None].astype(np.float32) + np.float32(0.5)
        weight = np.clip(reach - np.sqrt(x * x + y * y), 0, 1)
        return weight if shape.known is None else weight * shape.known

    def levels(self, value: Float) -> Float:
        """(N, 2) middle grey and half contrast by linear least squares, of bare crossings."""
        shape = crossing_shape(self.offset, value, None)
        weight, form = self.weight(value, shape), shape.value
        total = weight.sum(axis=1)
        mean_grey = (weight * self.grey).sum(axis=1) / total
        mean_form = (weight * form).sum(axis=1) / total
        apart = form - mean_form[:, None]
        power = np.maximum((weight * apart**2).sum(axis=1), 1e-6)
        half = (weight * apart * self.grey).sum(axis=1) / power
        return np.stack([mean_grey - half * mean_form, half], axis=-1).astype(np.float64)

    def step(self, value: Float) -> tuple[Float, Float]:
        """(N, PARAMETERS) Gauss-Newton change, and (N,) sigma of the position before it."""
        shape = crossing_shape(self.offset, value, self.markers)
        weight = self.weight(value, shape)
        model, jacobian = crossing_model(shape, value)
        residual = self.grey - model
        weighted = jacobian * weight[:, None]
        normal = (weighted @ jacobian.transpose(0, 2, 1)).astype(np.float64)
        scale = np.sqrt(np.maximum(np.einsum("nkk->nk", normal), 1e-12))
        normal = normal / scale[:, :, None] / scale[:, None] + 1e-9 * np.eye(PARAMETERS)
        inverse = np.linalg.inv(normal)
        wanted = (weighted @ residual[..., None])[..., 0] / scale
        change = (inverse @ wanted[..., None])[..., 0] / scale
        spare = np.maximum(weight.sum(axis=1) - PARAMETERS, 1)
        variance = (weight * residual**2).sum(axis=1) / spare
        position = np.einsum("nkk->nk", inverse)[:, :2] / scale[:, :2] ** 2
        square = variance * position.mean(axis=1)
        # A singular fit may come out negative: it has no sigma, and is no corner.
        return change, np.sqrt(np.where(square >= 0, square, np.nan))
