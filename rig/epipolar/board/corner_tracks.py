"""The slope plane of a board from the tracks of its corners through the views."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.geometry.epipolar_error import EpipolarError


@dataclass(frozen=True, slots=True)
class CornerPlane:
    """m = a + b (x - x0) + c (y - y0) through the slopes of all corners."""

    plane: Float
    """(3,) a, b, c."""
    sigma_px: float
    """1 sigma of a."""
    residual_px: float
    """Rms distance of the corners from their lines."""


def fit_corner_tracks(
    xy_px: Sequence[Float], x_steps: Float, y_steps: Float, reference: int, centre_px: Float
) -> CornerPlane:
    """Fit one straight track per corner, then a plane through the slopes.

    A corner at p appears at p - m s in the view at s = (x, y); p and m follow from all views and
    both coordinates by least squares. Light that changes across a picture moves the corners with a
    white square at the top left and those with a black one opposite ways; that takes no part in the
    plane, nor in its sigma.

    Args:
        xy_px: Per view (rows, columns, 2) corners, in one order.
        x_steps: (V,) view positions.
        y_steps: (V,).
        reference: Index of the view at (0, 0).
        centre_px: (2,) origin of the plane in the reference view.
    """
    place = np.stack([np.asarray(view, np.float64).reshape(-1, 2) for view in xy_px])
    step = np.stack([x_steps, y_steps], axis=-1)[:, None]
    step = step - step.mean(axis=0)
    moved = place - place.mean(axis=0)
    power = float((step**2).sum())
    slope = -(step * moved).sum(axis=(0, 2)) / power
    residual = moved + slope[:, None] * step
    freedom = residual.size - 3 * len(slope)
    row, column = np.indices(np.shape(xy_px[reference])[:2])
    colour = 1.0 - 2.0 * ((row + column) % 2).ravel()
    design = np.column_stack([np.ones(len(slope)), place[reference] - centre_px, colour])
    fitted, *_ = np.linalg.lstsq(design, slope, rcond=None)
    scatter = float(((slope - design @ fitted) ** 2).sum()) / max(len(slope) - design.shape[1], 1)
    covariance = np.linalg.inv(design.T @ design) * scatter
    return CornerPlane(
        fitted[:3],
        float(np.sqrt(covariance[0, 0])),
        float(np.sqrt((residual**2).sum() / max(freedom, 1))),
    )


def corner_epipolar_error(
    xy_px: Sequence[Float], x_steps: Float, y_steps: Float, reference: int
) -> EpipolarError:
    """How far corners lie from the epipolar lines of the reference view's corners.

    Args:
        xy_px: Per view (rows, columns, 2) corners, in one order.
        x_steps: (V,) view positions.
        y_steps: (V,).
        reference: Index of the view at (0, 0).

    Returns:
        Over all other views.
    """
    here = np.asarray(xy_px[reference], np.float64).reshape(-1, 2)
    distances: list[Float] = []
    for view, xy in enumerate(xy_px):
        length = float(np.hypot(x_steps[view], y_steps[view]))
        if length > 0.0:
            moved = np.asarray(xy, np.float64).reshape(-1, 2) - here
            across = moved[:, 1] * x_steps[view] - moved[:, 0] * y_steps[view]
            distances.append(np.abs(across) / length)
    return EpipolarError.of(np.concatenate(distances))
