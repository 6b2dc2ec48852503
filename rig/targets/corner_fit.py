"""Sub-pixel corners: fit two crossing blurred edges to the pixels around each."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel
from rig.targets.crossing import BLUR, HALF, MIDDLE, PARAMETERS, Markers, crossing_at, edges_of

_STEPS = 6
_SETTLED = np.array([2e-3, 2e-3, 2e-3, 2e-3, 1e-2])
"""Changes of place, angles and blur shrink quadratically: after these nothing is left to gain, and
the residual before them is that of the solution."""
_START_BLUR_PX = 1.0
_LARGEST_CHANGE = np.array([1.0, 1.0, 0.3, 0.3, 0.6, math.inf, math.inf])
_ROOM_PX = 2.0
"""Kept between the window and the next edge, for its blur."""
_SMALLEST_RADIUS_PX = 2.5
_LARGEST_RADIUS_PX = 7.0
_MIN_BLUR_PX = 0.3
_LOST_PX = 1000.0
"""From its start: no window holds such a corner."""


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
    base = np.round(xy_px).astype(np.int64)
    border_px = np.minimum(base, last - base).min(axis=1, initial=last.max())
    inside = border_px > _SMALLEST_RADIUS_PX
    room_px = np.minimum(clear_px - _ROOM_PX, border_px - 0.5)
    radius_px = np.clip(room_px, _SMALLEST_RADIUS_PX, _LARGEST_RADIUS_PX)

    value = np.zeros((len(xy_px), PARAMETERS))
    value[:, :2] = xy_px - base
    value[:, 2:4] = np.arctan2(axes[..., 1], axes[..., 0])
    value[:, BLUR] = _START_BLUR_PX
    measures = np.empty((0, 8)) if markers is None else markers.measures()
    measures = np.ascontiguousarray(measures, np.float64)
    sigma_px = _fit(np.ascontiguousarray(picture), base, value, radius_px, measures)
    found = base + value[:, :2]
    moved = np.abs(found - xy_px).max(axis=1, initial=0)
    good = inside & (moved < np.maximum(2.0, 0.3 * clear_px)) & np.isfinite(value).all(axis=1)
    return CrossingFit(
        np.where(good[:, None], found, np.nan),
        np.where(good, sigma_px, np.nan),
        value[:, BLUR],
        2 * value[:, HALF],
    )


@kernel()
def _fit(
    picture: NDArray[np.float32],
    base: NDArray[np.int64],
    value: Float,
    radius_px: Float,
    measures: Float,
) -> Float:
    """Fit N crossings in place; return (N,) sigma of the positions, NaN where there is none."""
    sigma_px = np.full(len(value), np.nan)
    own = np.zeros(8)
    for n in range(len(value)):
        if len(measures) > 0:
            own = measures[n]
        _set_levels(picture, base[n], value[n], radius_px[n], own)
        for _ in range(_STEPS):
            change, sigma_px[n] = _step(
                picture, base[n], value[n], radius_px[n], own, len(measures) > 0
            )
            settled = _take(value[n], change)
            # What has run away, or is no number, stays so.
            if settled or not abs(value[n, 0]) + abs(value[n, 1]) < _LOST_PX:
                break
    return sigma_px


@kernel()
def _take(value: Float, change: Float) -> bool:
    """Change the parameters, not by more than can be trusted; return whether they have settled."""
    settled = True
    for k in range(PARAMETERS):
        most = _LARGEST_CHANGE[k]
        value[k] += min(max(change[k], -most), most)
        if k < len(_SETTLED) and not abs(change[k]) < _SETTLED[k]:
            settled = False
    value[BLUR] = max(value[BLUR], _MIN_BLUR_PX)
    return settled


@kernel()
def _reach(place: float, base: int, radius_px: float, size: int) -> tuple[int, int]:
    """First pixel with a weight, and the one after the last, along one side of the picture."""
    first = math.ceil(base + place - radius_px - 0.5)
    last = math.floor(base + place + radius_px + 0.5)
    return max(first, 0), min(last + 1, size)


@kernel()
def _weight(x: float, y: float, radius_px: float) -> float:
    """One inside the radius about the estimate, fading to zero over a pixel."""
    return min(max(radius_px + 0.5 - math.sqrt(x * x + y * y), 0.0), 1.0)


@kernel()
def _set_levels(
    picture: NDArray[np.float32],
    base: NDArray[np.int64],
    value: Float,
    radius_px: float,
    measures: Float,
) -> None:
    """Set middle grey and half contrast by linear least squares, as of a bare crossing."""
    total = one = two = grey = both = 0.0
    edges = edges_of(value)
    low, high = _reach(value[1], base[1], radius_px, picture.shape[0])
    left, right = _reach(value[0], base[0], radius_px, picture.shape[1])
    for row in range(low, high):
        for column in range(left, right):
            x, y = column - base[0] - value[0], row - base[1] - value[1]
            weight = _weight(x, y, radius_px)
            if weight > 0:
                form = crossing_at(x, y, edges, measures, False)[0]
                level = float(picture[row, column])
                total += weight
                one += weight * form
                two += weight * form * form
                grey += weight * level
                both += weight * form * level
    if total > 0:
        power = max(two - one * one / total, 1e-6)
        value[HALF] = (both - one * grey / total) / power
        value[MIDDLE] = (grey - value[HALF] * one) / total


@kernel()
def _step(
    picture: NDArray[np.float32],
    base: NDArray[np.int64],
    value: Float,
    radius_px: float,
    measures: Float,
    has_markers: bool,
) -> tuple[Float, float]:
    """(PARAMETERS,) Gauss-Newton change, and the sigma of the position before it."""
    normal, wanted = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS)
    slope = np.empty(PARAMETERS)
    half, total, square = value[HALF], 0.0, 0.0
    edges = edges_of(value)
    low, high = _reach(value[1], base[1], radius_px, picture.shape[0])
    left, right = _reach(value[0], base[0], radius_px, picture.shape[1])
    for row in range(low, high):
        for column in range(left, right):
            x, y = column - base[0] - value[0], row - base[1] - value[1]
            weight = _weight(x, y, radius_px)
            if weight <= 0:
                continue
            form, by_x, by_y, by_first, by_second, by_blur, known = crossing_at(
                x, y, edges, measures, has_markers
            )
            weight *= known
            if weight <= 0:
                continue
            slope[0], slope[1], slope[2] = half * by_x, half * by_y, half * by_first
            slope[3], slope[4], slope[5], slope[6] = half * by_second, half * by_blur, 1.0, form
            residual = float(picture[row, column]) - value[MIDDLE] - half * form
            total += weight
            square += weight * residual * residual
            for i in range(PARAMETERS):
                part = weight * slope[i]
                wanted[i] += part * residual
                for j in range(i + 1):
                    normal[i, j] += part * slope[j]
    inverse, scale = _inverse(normal)
    change = np.zeros(PARAMETERS)
    for i in range(PARAMETERS):
        for j in range(PARAMETERS):
            change[i] += inverse[i, j] * wanted[j] / (scale[i] * scale[j])
    variance = square / max(total - PARAMETERS, 1.0)
    place = (inverse[0, 0] / scale[0] ** 2 + inverse[1, 1] / scale[1] ** 2) / 2 * variance
    # A singular fit may come out negative: it has no sigma, and is no corner.
    return change, math.sqrt(place) if place >= 0 else math.nan


@kernel()
def _inverse(normal: Float) -> tuple[Float, Float]:
    """Inverse of the scaled normal matrix, of which the lower half is given, and the scale.

    By Gauss and Jordan, in place: what is positive needs no pivots, and scaling leaves ones on the
    diagonal.
    """
    scale = np.empty(PARAMETERS)
    for i in range(PARAMETERS):
        scale[i] = math.sqrt(max(normal[i, i], 1e-12))
    inverse = np.empty((PARAMETERS, PARAMETERS))
    for i in range(PARAMETERS):
        for j in range(PARAMETERS):
            inverse[i, j] = normal[max(i, j), min(i, j)] / (scale[i] * scale[j])
        inverse[i, i] += 1e-9
    for k in range(PARAMETERS):
        pivot = 1.0 / inverse[k, k]
        inverse[k, k] = 1.0
        for j in range(PARAMETERS):
            inverse[k, j] *= pivot
        for i in range(PARAMETERS):
            if i != k:
                share = inverse[i, k]
                inverse[i, k] = 0.0
                for j in range(PARAMETERS):
                    inverse[i, j] -= share * inverse[k, j]
    return inverse, scale
