"""By how much the rows of a rig miss, from all corners of a sweep."""

from collections.abc import Sequence

import numpy as np

from rig.arrays import Float
from rig.epipolar.mending.corner_rows import CornersBeside, rows_of_corners
from rig.epipolar.mending.patches import directions
from rig.epipolar.mending.row_errors import RowErrors
from rig.measurement import Measurement
from rig.optics.optics import Optics


def rows_of_sweep(
    measured: Sequence[Measurement], names: Sequence[str], optics: Optics
) -> RowErrors | None:
    """Fit one field per view to the corners of all samples.

    Args:
        measured: the samples.
        names: of the views, in the order of the profile.
        optics: what they were measured with.

    Returns:
        None where a sample was measured by a version that did not look, or none shows the board.
    """
    seen = [one for one in measured if one.slope_px is not None]
    sizes_px = {one.size_px for one in seen}
    (size_px,) = sizes_px if len(sizes_px) == 1 else (None,)
    if size_px is None or any(one.across_px is None for one in seen):
        return None
    steps = np.stack([optics.x_steps, optics.y_steps], axis=1)
    corners = [
        None if not step.any() else _beside(seen, name, step)
        for name, step in zip(names, steps, strict=True)
    ]
    return rows_of_corners(corners, optics.x_steps, optics.y_steps, (size_px[1], size_px[0]))


def _beside(seen: Sequence[Measurement], name: str, step: Float) -> CornersBeside | None:
    parts = [_of_sample(one, name, step) for one in seen if name in one.views]
    whole = [part for part in parts if part is not None]
    if not whole:
        return None
    return CornersBeside(*np.concatenate(whole, axis=1))


def _of_sample(one: Measurement, name: str, step: Float) -> Float | None:
    """(4, N): columns and rows on the lines of a view, slopes, and what lies across."""
    if one.plane is None or one.centre_px is None or not one.corners_px or one.across_px is None:
        return None
    a, b, c = one.plane
    here = np.asarray(one.corners_px, np.float64).reshape(-1, 2)
    away = here - np.array(one.centre_px)
    slope_px = a + away @ np.array([b, c])
    along, _ = directions(float(step[0]), float(step[1]))
    x_px, y_px = (here - slope_px[:, None] * np.hypot(*step) * along).T
    across_px = np.asarray(one.across_px[one.views.index(name)])
    return np.stack([x_px, y_px, slope_px, across_px])
