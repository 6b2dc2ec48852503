"""Where views that are not rectified leave the epipolar lines, as a smooth field per view."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.epipolar.mending.patches import directions

_NOTICEABLE = 3.0
"""Residual of the tracks, in sigmas of a corner, above which a field is fitted."""


@dataclass(frozen=True, slots=True)
class Misalignment:
    """Displacement of every view from the lines, quadratic in the reference pixel."""

    coefficients: Float
    """(V, 2, 6) of 1, x, y, x^2, xy, y^2 about the centre."""
    centre_px: Float

    def at(self, pixels: Float) -> Float:
        """Displacement (V, 2, N) along x and y at reference pixels (2, N)."""
        return self.coefficients @ _basis(pixels - self.centre_px[:, None])

    @classmethod
    def none(cls, views: int, centre_px: Float) -> "Misalignment":
        """Return the field of rectified views: zero."""
        return cls(np.zeros((views, 2, 6)), centre_px)


def is_misaligned(residual_px: float, corner_sigma_px: float) -> bool:
    """Whether tracks are less straight than the corners are precise.

    Args:
        residual_px: rms distance of the corners from their tracks.
        corner_sigma_px: what one corner may be off by its own noise.
    """
    return residual_px > _NOTICEABLE * corner_sigma_px


def across_px(xy_px: Sequence[Float], x_steps: Float, y_steps: Float, reference: int) -> Float:
    """By how much the corners of each view lie across the lines of the reference's corners.

    Args:
        xy_px: per view (rows, columns, 2) corners, in one order.
        x_steps: (V,) view positions.
        y_steps: (V,).
        reference: index of the view at (0, 0).

    Returns:
        (V, N) along `directions`' second vector; 0 in a view at the place of the reference.
    """
    place = np.stack([np.asarray(view, np.float64).reshape(-1, 2) for view in xy_px])
    return np.einsum("vni,vi->vn", place - place[reference], _across(x_steps, y_steps))


def rows_met(
    xy_px: Sequence[Float], x_steps: Float, y_steps: Float, reference: int, centre_px: Float
) -> list[Float]:
    """Bring corners onto the lines of the reference's corners, by a smooth field in each view.

    What lies across a line tells nothing of the slope, yet moves tracks that all views share.

    Args:
        xy_px: per view (rows, columns, 2) corners, in one order.
        x_steps: (V,) view positions.
        y_steps: (V,).
        reference: index of the view at (0, 0).
        centre_px: (2,) in the reference view.

    Returns:
        The same with the field taken out.
    """
    here = np.asarray(xy_px[reference], np.float64).reshape(-1, 2)
    basis = _basis((here - centre_px).T)
    scaled = basis / np.abs(basis).max(axis=1)[:, None]
    beside = across_px(xy_px, x_steps, y_steps, reference)
    fitted, *_ = np.linalg.lstsq(scaled.T, beside.T)
    smooth = (scaled.T @ fitted).T[..., None] * _across(x_steps, y_steps)[:, None]
    return [xy - off.reshape(xy.shape) for xy, off in zip(xy_px, smooth, strict=True)]


def fit_misalignment(
    xy_px: Sequence[Float],
    x_steps: Float,
    y_steps: Float,
    reference: int,
    plane: Float,
    centre_px: Float,
    *,
    residual_px: float,
    corner_sigma_px: float,
) -> Misalignment:
    """Fit what is left of the corners' tracks once the slope plane is taken out.

    Lens distortion and turned cameras move a view's picture smoothly against the others; over a
    board a quadratic in each view follows that. Where the tracks are as straight as the corners are
    precise, there is nothing to follow, and the field is zero.

    Args:
        xy_px: per view (rows, columns, 2) corners, in one order.
        x_steps: (V,) view positions.
        y_steps: (V,).
        reference: index of the view at (0, 0); its field is zero.
        plane: (3,) slope plane of the tracks about `centre_px`.
        centre_px: (2,) in the reference view.
        residual_px: rms distance of the corners from their tracks.
        corner_sigma_px: what one corner may be off by its own noise.
    """
    views = len(xy_px)
    if not is_misaligned(residual_px, corner_sigma_px):
        return Misalignment.none(views, centre_px)
    place = np.stack([np.asarray(view, np.float64).reshape(-1, 2).T for view in xy_px])
    offset = place[reference] - centre_px[:, None]
    slope = plane @ np.stack([np.ones(offset.shape[1]), *offset])
    steps = np.stack([x_steps, y_steps], axis=-1)[:, :, None]
    left = place - place[reference] + slope * steps
    basis = _basis(offset)
    scale = np.abs(basis).max(axis=1)
    fitted, *_ = np.linalg.lstsq((basis / scale[:, None]).T, left.reshape(views * 2, -1).T)
    return Misalignment((fitted / scale[:, None]).T.reshape(views, 2, 6), centre_px)


def _across(x_steps: Float, y_steps: Float) -> Float:
    """(V, 2) unit vectors across the lines, 0 where a view has none."""
    return np.stack(
        [
            directions(x, y)[1] if np.hypot(x, y) > 0.0 else np.zeros(2)
            for x, y in zip(x_steps.tolist(), y_steps.tolist(), strict=True)
        ]
    )


def _basis(offset: Float) -> Float:
    x, y = offset
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])
