"""The board's plane as a hypothesis for the dense estimator; from a dense map one slope again.

Dense matching of a periodic board without a hypothesis locks onto slopes that are wrong by whole
periods; the corners know the period.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.board.slope import BoardSlope
from rig.epipolar.estimate import estimate_slopes
from rig.epipolar.views import Label, RectifiedViews, SlopeMap, SlopePrior
from rig.errors import SlopeError

_PRIOR_SIGMA_PX = 0.25
"""Room for a board that is not flat and for imperfect rectification."""
_BLOCK_PX = 16
"""Errors of a dense map are correlated over its windows; blocks of this size count as one."""
_FEWEST_PIXELS = 100
_SURROUNDINGS_PX = 32
"""How far around a pixel the estimator looks, with a margin."""
_TUKEY = 4.685
_STEPS = 10


@dataclass(frozen=True, slots=True)
class DenseBoardSlope:
    """Slope of a board by the dense estimator, at `BoardSlope.centre_px`."""

    slope_px: float
    """px per view step."""
    sigma_px: float
    """1 sigma, from the scatter of blocks about the plane."""
    pixels: int
    """Pixels of the board with a slope."""
    pixel_sigma_px: float
    """Median 1 sigma of one of them."""


def plane_prior(slope: BoardSlope, shape: tuple[int, int]) -> SlopePrior:
    """Return the board's plane as a hypothesis for `estimate_slopes`.

    Args:
        slope: The line fit of the board.
        shape: Height and width of the reference view.

    Returns:
        The plane inside `BoardSlope.outline_px`, NaN elsewhere, with a sigma of 0.25 px or of one
        sixteenth of the board's period, whichever is less.
    """
    y, x = np.indices(shape).astype(np.float64)
    plane = np.where(_inside(slope, shape), slope.slope_at(x, y), np.nan)
    sigma_px = min(_PRIOR_SIGMA_PX, slope.period_px / 16)
    return SlopePrior(plane.astype(np.float32), np.full(shape, sigma_px, np.float32))


def measure_dense(
    views: RectifiedViews, slope_range_px: tuple[float, float], board: BoardSlope
) -> DenseBoardSlope:
    """Run the dense estimator on the part of the views that shows the board.

    Args:
        views: the whole views.
        slope_range_px: lowest and highest slope to search beside the board.
        board: the line fit, as the hypothesis on the board.

    Raises:
        SlopeError: the views give too few answers on the board.
    """
    window = _window(views, board)
    part = replace(views, images=views.images[:, *window])
    prior = plane_prior(board, views.shape)
    found = estimate_slopes(
        part, slope_range_px, SlopePrior(prior.slope_px[window], prior.sigma_px[window])
    )
    slope_px = np.full(views.shape, np.nan, np.float32)
    sigma_px, label = slope_px.copy(), np.zeros(views.shape, np.uint8)
    slope_px[window], sigma_px[window] = found.slope_px, found.sigma_px
    label[window] = found.label
    return dense_board_slope(SlopeMap(slope_px, sigma_px, label, found.warnings), board)


def _window(views: RectifiedViews, board: BoardSlope) -> tuple[slice, slice]:
    """Rows and columns that hold the board in every view, and what the estimator looks at."""
    slopes = np.abs(board.slope_at(board.outline_px[:, 0], board.outline_px[:, 1]))
    longest = float(np.hypot(views.x_steps, views.y_steps).max())
    margin_px = int(np.ceil(float(slopes.max()) * longest)) + _SURROUNDINGS_PX
    (left, top), (right, bottom) = board.outline_px.min(axis=0), board.outline_px.max(axis=0)
    rows = slice(max(0, int(top) - margin_px), int(bottom) + margin_px + 1)
    return rows, slice(max(0, int(left) - margin_px), int(right) + margin_px + 1)


def dense_board_slope(slopes: SlopeMap, board: BoardSlope) -> DenseBoardSlope:
    """Reduce a dense map to the slope at the board's centre.

    A plane is fitted to all answers within the board's outline, weighted by their own precision
    and by Tukey's biweight (Beaton and Tukey, Technometrics 16, 1974) of their residual; blocks of
    pixels give the covariance, because neighbours share their errors.

    Raises:
        SlopeError: the map has too few answers on the board.
    """
    answered = slopes.label != Label.NONE
    row, column = np.nonzero(_inside(board, slopes.slope_px.shape) & answered)
    if row.size < _FEWEST_PIXELS:
        raise SlopeError(
            f"{row.size} pixels of the board have a dense slope, {_FEWEST_PIXELS} are needed",
            advice="bring the board nearer or add light",
        )
    x0, y0 = board.centre_px
    design = np.stack([np.ones(row.size), (column - x0) / _BLOCK_PX, (row - y0) / _BLOCK_PX])
    value = slopes.slope_px[row, column].astype(np.float64)
    sigma = slopes.sigma_px[row, column].astype(np.float64)
    plane = np.array(board.plane) * (1, _BLOCK_PX, _BLOCK_PX)
    for _ in range(_STEPS):
        weight, _ = _tukey(value - plane @ design, sigma)
        plane = np.linalg.solve((design * weight) @ design.T, design @ (weight * value))
    residual = value - plane @ design
    weight, rate = _tukey(residual, sigma)
    score = design * (weight * residual)
    block = row // _BLOCK_PX * slopes.slope_px.shape[1] + column // _BLOCK_PX
    _, block = np.unique(block, return_inverse=True)
    summed = np.stack([np.bincount(block, line) for line in score])
    bread = np.linalg.inv((design * rate) @ design.T)
    variance = (bread @ (summed @ summed.T) @ bread)[0, 0]
    return DenseBoardSlope(
        float(plane[0]), float(np.sqrt(variance)), int(row.size), float(np.median(sigma))
    )


def _inside(slope: BoardSlope, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    mask = np.zeros(shape, np.uint8)
    cv2.fillConvexPoly(mask, np.round(slope.outline_px).astype(np.int32), 1)
    return mask > 0


def _tukey(residual: Float, sigma: Float) -> tuple[Float, Float]:
    """Weights, and rates at which the weighted residuals change with the residuals."""
    normed = residual / sigma
    scale = 1.4826 * float(np.median(np.abs(normed))) + 1e-12
    square = (normed / (_TUKEY * scale)) ** 2
    inside = np.clip(1 - square, 0, None)
    return inside**2 / sigma**2, inside * (1 - 5 * square) / sigma**2
