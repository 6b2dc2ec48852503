"""Find all circles of a grid, or say why they cannot be found."""

import numpy as np

from rig.arrays import Float
from rig.errors import TargetError
from rig.targets.checkerboard_diagnosis import exposure_at_fault
from rig.targets.circles.arrange import arrange
from rig.targets.circles.blobs import find_blobs
from rig.targets.circles.centres import Centres, measure_centres
from rig.targets.circles.grid import CircleGrid
from rig.targets.detection import Detection
from rig.targets.pyramid import Image, from_level, pyramid

_LEVELS = 4
_LEAST_GAP_PX = 4.0
"""Between two circles: with less, the edges of neighbours run together."""
_MOST_BLUR = 0.2
"""Sigma of the edges over the gap, above which they do."""
_MOST_MOVED = 0.3
"""From where an outline says to the centroid, in radii."""


def find_circles(image: Image, grid: CircleGrid) -> Detection:
    """Find all circles of a grid to sub-pixel precision: the middles of their ellipses.

    A part is refused: nothing on it says which circle is which.

    Args:
        image: (H, W) grey, finite; float32 in 8-bit grey levels.
        grid: what to look for.

    Raises:
        TargetError: not found as asked for; `reason` is one of wrong-count, clipped, too-small,
            blurred, over-exposed, under-exposed, not-found.
    """
    pictures = pyramid(image, _LEVELS)
    most, blobs = 0, 0
    for level, picture in enumerate(pictures):
        found_px = find_blobs(picture)
        order, held = arrange(found_px, grid)
        if held > most or (held == most and len(found_px) > blobs):
            most, blobs = held, len(found_px)
        if order is not None:
            start_px = from_level(found_px[order], level)
            return _checked(measure_centres(pictures[0], start_px, grid), start_px, grid)
    raise _why_not(image, grid, most, blobs)


def _checked(centres: Centres, start_px: Float, grid: CircleGrid) -> Detection:
    plane_px = start_px.reshape(grid.rows, grid.columns, 2)
    step_px = np.linalg.norm(np.diff(plane_px, axis=0), axis=2).min()
    gap_px = float(step_px) * grid.gap_mm / (np.sqrt(2.0) * grid.spacing_mm)
    if gap_px < _LEAST_GAP_PX:
        raise TargetError(
            f"grid of {grid} circles found with {gap_px:.1f} px of white between them, at least "
            f"{_LEAST_GAP_PX:.0f} px are needed",
            advice="bring the grid nearer, or tilt it less",
            reason="too-small",
        )
    known = np.isfinite(centres.sigma_px)
    blur_px = float(np.median(centres.blur_px[known])) if known.any() else float("nan")
    if blur_px > _MOST_BLUR * gap_px:
        raise TargetError(
            f"grid of {grid} circles found with edges blurred by {blur_px:.1f} px and "
            f"{gap_px:.1f} px of white between them",
            advice="focus the lens, or hold the grid still",
            reason="blurred",
        )
    radius_px = float(step_px) * grid.diameter_mm / (2.0 * np.sqrt(2.0) * grid.spacing_mm)
    moved_px = np.linalg.norm(np.nan_to_num(centres.xy_px, nan=np.inf) - start_px, axis=1)
    lost = int((~(moved_px < max(_MOST_MOVED * radius_px, 1.5))).sum())
    if lost:
        raise TargetError(
            f"grid of {grid} circles asked for, {lost} of them cannot be measured: at the border "
            "of the picture, in glare, or covered",
            advice="move the grid until all of it is in view, with its white around it",
            reason="clipped",
        )
    return Detection(
        np.arange(grid.rows * grid.columns, dtype=np.intp),
        centres.xy_px,
        centres.sigma_px,
        blur_px,
        float(np.median(centres.contrast)),
    )


def _why_not(image: Image, grid: CircleGrid, most: int, blobs: int) -> TargetError:
    count = grid.rows * grid.columns
    asked = f"grid of {grid} circles in shifted rows asked for"
    exposure = exposure_at_fault(image, asked)
    if exposure is not None:
        return exposure
    if most >= count / 2:
        return TargetError(
            f"{asked}, found {most} of its {count} circles",
            advice="move it until all of it is in view, without glare; a part does not tell which "
            "circle is which",
            reason="clipped",
        )
    if blobs >= count / 2:
        return TargetError(
            f"{asked}, found {blobs} dark circles but not in such rows",
            advice="set columns (circles in a row) and rows to what the grid has; its rows are "
            "shifted in turn",
            reason="wrong-count",
        )
    return TargetError(
        f"{asked}, found {blobs} dark circle{'' if blobs == 1 else 's'}",
        advice="put the grid in view and light it; its circles are black on white",
        reason="not-found",
    )
