"""Row errors from the corners of a board that was carried through the whole depth.

A camera off its place moves corners across its lines in proportion to their slopes. In one scene
that can hardly be told from rows that miss; over a sweep the same places show many slopes, and the
two come apart. Only what belongs to the place in the picture is an error of the rows.
"""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.epipolar.mending.patches import directions
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.mending.smooth_field import TERMS, SmoothField, fit_field

_EXPECTED_PX = 3.0
_CORNER_PX = 0.02
_SURE = 4.0
_LEAST_SPREAD_PX = 0.5
"""Slopes that spread less tell nothing of what is in proportion to them."""


@dataclass(frozen=True, slots=True)
class CornersBeside:
    """Corners of one view, from all samples."""

    x_px: Float
    """(N,) columns of the common frame where its lines have them."""
    y_px: Float
    """(N,) rows."""
    slope_px: Float
    """(N,) of the board there, px per view step."""
    across_px: Float
    """(N,) by how much they lie across their lines, along `directions`' second vector."""


def rows_of_corners(
    corners: list[CornersBeside | None],
    x_steps: Float,
    y_steps: Float,
    shape: tuple[int, int],
) -> RowErrors:
    """Fit the row errors of every view to all of its corners.

    Args:
        corners: of each view; None for the reference, and where there are none.
        x_steps: (V,) view positions.
        y_steps: (V,).
        shape: height and width of the common frame, px.

    Returns:
        A field of every view with enough corners, also where its rows meet.
    """
    nowhere = np.zeros(0), np.zeros(0)
    across, per_slope = np.zeros((len(corners), 2)), np.zeros(len(corners))
    fields: list[SmoothField | None] = [None] * len(corners)
    places = [nowhere] * len(corners)
    for i, seen in enumerate(corners):
        if seen is not None and len(seen.x_px) > TERMS:
            across[i] = directions(float(x_steps[i]), float(y_steps[i]))[1]
            fields[i], per_slope[i] = _field(seen, shape)
            places[i] = seen.x_px, seen.y_px
    return RowErrors.of(tuple(fields), across, places, per_slope)


def _field(seen: CornersBeside, shape: tuple[int, int]) -> tuple[SmoothField, float]:
    """The field, and what follows the slope."""
    sigmas = np.full(len(seen.x_px), _CORNER_PX)

    def fit(values: Float) -> SmoothField:
        return fit_field(seen.x_px, seen.y_px, values, sigmas, shape, _EXPECTED_PX)

    def rest(values: Float) -> Float:
        return values - fit(values).at(seen.x_px, seen.y_px)

    # Of both, what no place in the picture explains (R. Frisch and F. V. Waugh, Econometrica 1,
    # 1933): the slope of the one by the other is that of the joint fit.
    slope, beside = rest(seen.slope_px), rest(seen.across_px)
    power = float(slope @ slope)
    if power < len(slope) * _LEAST_SPREAD_PX**2:
        return fit(seen.across_px), 0.0
    rate = float(slope @ beside) / power
    error = float(np.std(beside - rate * slope)) / power**0.5
    if abs(rate) <= _SURE * error:
        return fit(seen.across_px), 0.0
    return fit(seen.across_px - rate * seen.slope_px), rate
