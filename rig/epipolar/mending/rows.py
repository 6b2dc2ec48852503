"""Rows that do not meet: by how much each view lies across its epipolar lines, over the picture.

Factory calibrations of stereo cameras are good to about a pixel, and drift. Across the lines no
depth moves anything, so what patches of the pictures lie beside them is an error of the
rectification, whatever the scene (as in the quality measure of A. Fusiello and L. Irsara,
"Quasi-Euclidean uncalibrated epipolar rectification", ICPR 2008). It varies smoothly over the
picture; the field is taken out before slopes are searched.
"""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.epipolar.mending.first_match import FirstMatch
from rig.epipolar.mending.patches import (
    Patches,
    directions,
    distinctness,
    find_patches,
    most_distinct,
    most_distinct_near,
)
from rig.epipolar.mending.row_errors import NOTICEABLE_PX, RowErrors
from rig.epipolar.mending.smooth_field import (
    DOUBT,
    SmoothField,
    coarse_rms,
    fit_field,
    is_worth_it,
    normal_equations,
)
from rig.epipolar.search.window import Cameras

Map = NDArray[np.float32]

_EXPECTED_PX = 3.0
_SURE, _AT_A_GLANCE = 4.0, 0.8
_PATCHES, _FEWEST = 2400, 40
"""Begun, over all views; and found in one."""
_SMALLEST_CELL_PX = 5
_SMALL_REACH_PX, _REACH_PX = 2.5, 2.0
"""Farthest that a patch may lie from where the match, and its smaller picture, put it."""
_SURE_PX = 0.25
"""Patches that are less sure slide along an edge, or drown in noise."""
_LEAST_SIGMA_PX = 0.05
"""What a patch is off by however clear it is: sampling, and surfaces that are not square-on."""
_ROUNDS, _NEARLY = 4, 1.15
_LEAST_SPREAD_PX = 0.5
"""Shifts along the lines that spread less tell nothing of what is in proportion to them."""
_NOWHERE = np.zeros(0), np.zeros(0)


def find_row_errors(
    images: NDArray[np.generic],
    cameras: Cameras,
    first: FirstMatch,
    per_slope: Float | None = None,
) -> RowErrors:
    """Measure by how much the views lie across their lines.

    Args:
        images: (V, H, W) grey values as they come.
        cameras: where the views stand.
        first: a first match of smaller pictures.
        per_slope: (V,) what lies across is known to be in proportion to the slope, px per px; it is
            taken off. None where nothing is known.
    """
    views, shape = len(images), (images.shape[1], images.shape[2])
    small, factor, reference = first.images, first.factor, cameras.reference
    cell_px = max(_SMALLEST_CELL_PX, round((small[0].size * views / _PATCHES) ** 0.5))
    near = most_distinct(distinctness(small[reference]), cell_px)
    soft = _soft(images)
    strength = distinctness(soft[reference])
    fields: list[SmoothField | None] = [None] * views
    across, places = np.zeros((views, 2)), [_NOWHERE] * views
    for i in range(views):
        steps = float(cameras.x_steps[i]), float(cameras.y_steps[i])
        if i == reference or np.hypot(*steps) == 0.0:
            continue
        across[i] = directions(*steps)[1]
        along_px = -np.hypot(*steps) * first.slope_px[near].astype(np.float64)
        found = find_patches(
            small[reference], small[i], *near, along_px, np.zeros_like(along_px), steps,
            _SMALL_REACH_PX,
        )  # fmt: skip
        rows, columns = most_distinct_near(
            strength, factor * found.rows, factor * found.columns, factor
        )
        found = find_patches(
            soft[reference], soft[i], rows, columns, factor * found.along_px,
            factor * found.across_px, steps, _REACH_PX,
        )  # fmt: skip
        found = found[found.sigma_px < _SURE_PX]
        if per_slope is not None:
            slope_px = -found.along_px / np.hypot(*steps)
            found = replace(found, across_px=found.across_px - per_slope[i] * slope_px)
        if len(found.rows) >= _FEWEST:
            fields[i], places[i] = _field(found, steps, shape)
    judged = RowErrors.of(tuple(fields), across, places)
    return replace(
        judged,
        fields=tuple(
            f if rms > 0.0 else None for f, rms in zip(fields, judged.rms_px, strict=True)
        ),
    )


def _soft(images: NDArray[np.generic]) -> Map:
    """Mean over 3 x 3 pixels: what interpolation would smooth is gone before."""
    soft = np.empty(images.shape, np.float32)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            cv2.blur(images[i].astype(np.float32), (3, 3), dst=soft[i])

    run_in_bands(work, len(images))
    return soft


def _measured(found: Patches, steps: tuple[float, float]) -> tuple[Float, Float, Float, Float]:
    """Where patches would lie in the view if its rows met, shifts across and their sigmas.

    A camera off its place moves patches across in proportion to their slopes: that is no error of
    its rows (`placement` looks for it), and is taken off.
    """
    x, y = found.on_line_px(steps)
    sigma = np.hypot(found.sigma_px, _LEAST_SIGMA_PX)
    return x, y, found.across_px - _by_slope(found, sigma, x, y), sigma


def _by_slope(found: Patches, sigma: Float, x: Float, y: Float) -> Float:
    """Part of the shifts across that follows the shift along, (N,).

    Where it explains them nearly as well as a field does, it is the simpler reason and believed.
    """
    if len(x) < _FEWEST or float(found.along_px.std()) < _LEAST_SPREAD_PX:
        return np.zeros_like(x)
    design = np.stack([np.ones_like(x), found.along_px], axis=1)
    weight, line, covariance = 1.0 / sigma**2, np.zeros(2), np.eye(2)
    spread = 1.0
    for _ in range(_ROUNDS):
        normal, right = normal_equations(design, weight, found.across_px)
        covariance = np.linalg.inv(normal)
        line = covariance @ right
        rest = (found.across_px - design @ line) / sigma
        spread = max(1.4826 * float(np.median(np.abs(rest))), 1e-6)
        weight = 1.0 / (sigma * spread) ** 2 / (1.0 + (rest / (DOUBT * spread)) ** 2)
    shape = int(y.max()) + 2, int(x.max()) + 2
    field = fit_field(x, y, found.across_px, sigma, shape, _EXPECTED_PX)
    left = 1.4826 * float(np.median(np.abs((found.across_px - field.at(x, y)) / sigma)))
    is_sure = abs(line[1]) > _SURE * float(covariance[1, 1]) ** 0.5
    return line[1] * found.along_px if is_sure and spread < _NEARLY * left else np.zeros_like(x)


def _field(
    found: Patches, steps: tuple[float, float], shape: tuple[int, int]
) -> tuple[SmoothField | None, tuple[Float, Float]]:
    """A field that is worth taking out, and where it was measured."""
    if coarse_rms(*found.on_line_px(steps), found.across_px, shape) < _AT_A_GLANCE * NOTICEABLE_PX:
        return None, _NOWHERE
    measured = _measured(found, steps)
    if not is_worth_it(*measured, shape, _EXPECTED_PX):
        return None, _NOWHERE
    return fit_field(*measured, shape, _EXPECTED_PX), measured[:2]
