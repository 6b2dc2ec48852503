"""What a curve of a calibration alone misses true points by, in units of its own sigma.

True cameras project points by projective geometry of their own; what is asked is the way back:
rectification, slope, the axis, and the curve.
"""

from collections.abc import Sequence

import numpy as np

from rig.arrays import Float
from rig.curve import Curve
from rig.geometry.rectification import Rectification
from tests.support.calibration_scene import HEIGHT, WIDTH, TrueCamera

_COLUMNS, _ROWS = 9, 7


def misses(
    rectification: Rectification,
    curve: Curve,
    true: Sequence[TrueCamera],
    distances_mm: Sequence[float],
) -> Float:
    """(N,) error of depth over its sigma, at points all over the picture that two views see.

    Args:
        rectification: by the calibration.
        curve: of the calibration.
        true: the cameras; the first is the reference, with its centre at the origin.
        distances_mm: of the points.
    """
    x, y = np.meshgrid(np.linspace(40, WIDTH - 41, _COLUMNS), np.linspace(30, HEIGHT - 31, _ROWS))
    rays = np.stack([(x.ravel() - 639.5) / 882, (y.ravel() - 399.5) / 882, np.ones(x.size)], axis=1)
    found: list[Float] = []
    for distance_mm in distances_mm:
        shown = [camera.project(rays * distance_mm) for camera in true]
        found.append(_misses_at(rectification, curve, shown, distance_mm))
    return np.concatenate(found)


def _misses_at(
    rectification: Rectification, curve: Curve, shown: Sequence[Float], distance_mm: float
) -> Float:
    here = rectification.rectified_px(0, shown[0])
    along, steps2 = np.zeros(len(here)), np.zeros(len(here))
    for view in range(1, len(shown)):
        xy = shown[view]
        inside = ((xy > 0) & (xy < (WIDTH - 1, HEIGHT - 1))).all(axis=1)
        inside &= ((shown[0] > 0) & (shown[0] < (WIDTH - 1, HEIGHT - 1))).all(axis=1)
        step = np.array([rectification.x_steps[view], rectification.y_steps[view]])
        # What a view before or behind the plane of the others sees otherwise.
        bend = _bend(rectification, view, here, distance_mm)
        away = here - (rectification.rectified_px(view, xy) - bend)
        along += np.where(inside, away @ step, 0.0)
        steps2 += np.where(inside, step @ step, 0.0)
    seen = steps2 > 0
    pixels, slope_px = here[seen], along[seen] / steps2[seen]
    on_axis = rectification.axis_slope_px(slope_px, pixels.T)
    expected_px = curve.law.slope_px(np.array([distance_mm]))
    variance_px2 = curve.curve_sigma_px(np.array([distance_mm])) ** 2
    assert curve.field is not None
    off = pixels - curve.field.at_px
    variance_px2 = variance_px2 + np.einsum("ni,ij,nj->n", off, curve.field.covariance, off)
    return (on_axis - expected_px) / np.sqrt(variance_px2)


def _bend(rectification: Rectification, view: int, here: Float, distance_mm: float) -> Float:
    slope_px = rectification.inverse_law_px_mm / distance_mm - rectification.infinity_px
    slopes = np.full(len(here), slope_px)
    step = np.array([rectification.x_steps[view], rectification.y_steps[view]])
    line = rectification.line_px(view, here.T, slopes).T
    return line - (here - slopes[:, None] * step)
