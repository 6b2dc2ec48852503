"""Fills small holes of a slope map, and says so: label 4.

A hole is bridged by a straight line between the answered pixels at both of its ends, along its row
or its column, whichever end points agree better. Nothing was measured there: everything between
both ends is taken for equally likely, which adds their difference / sqrt(12) to sigma (JCGM
100:2008, 4.3.7).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig.epipolar import Label, SlopeMap

Map = NDArray[np.float32]
Mask = NDArray[np.bool_]


def filled(slopes: SlopeMap, answered: Mask, largest_px: int) -> SlopeMap:
    """Return slopes with holes filled; answered pixels are as they were.

    A slope that is not answered but known better than the bridge stays as it is.

    Args:
        slopes: of one multi-view.
        answered: (H, W) which of them are sure enough for the use at hand.
        largest_px: longest way between two answered pixels that is bridged.
    """
    along_rows = _bridged(slopes.slope_px, slopes.sigma_px, answered, largest_px)
    along_columns = _bridged(slopes.slope_px.T, slopes.sigma_px.T, answered.T, largest_px)
    is_row = along_rows[1] <= along_columns[1].T
    slope_px, sigma_px = (
        np.where(is_row, row, column.T)
        for row, column in zip(along_rows, along_columns, strict=True)
    )
    better = np.isfinite(sigma_px) & ~answered & ~(slopes.sigma_px <= sigma_px)
    return replace(
        slopes,
        slope_px=np.where(better, slope_px, slopes.slope_px),
        sigma_px=np.where(better, sigma_px, slopes.sigma_px),
        label=np.where(better, np.uint8(Label.FILLED), slopes.label),
    )


def _bridged(slope_px: Map, sigma_px: Map, answered: Mask, largest_px: int) -> tuple[Map, Map]:
    """Slope and sigma along the rows, (H, W); sigma is infinite where there is no bridge."""
    width = slope_px.shape[1]
    column = np.arange(width)
    left = np.maximum.accumulate(np.where(answered, column, -1), axis=1)
    right = np.minimum.accumulate(np.where(answered, column, width)[:, ::-1], axis=1)[:, ::-1]
    is_bridged = (left >= 0) & (right < width) & (right - left <= largest_px + 1) & ~answered
    row, at = np.nonzero(is_bridged)
    first, last = left[row, at], right[row, at]
    share = (at - first) / (last - first)
    ends_px, sigmas_px = (
        (values[row, first].astype(np.float64), values[row, last].astype(np.float64))
        for values in (slope_px, sigma_px)
    )
    bridge_px = np.full_like(slope_px, np.nan)
    spread_px = np.full_like(slope_px, np.inf)
    bridge_px[row, at] = (1 - share) * ends_px[0] + share * ends_px[1]
    of_ends = (1 - share) * sigmas_px[0] + share * sigmas_px[1]
    spread_px[row, at] = np.hypot(of_ends, (ends_px[1] - ends_px[0]) / 12**0.5)
    return bridge_px, spread_px
