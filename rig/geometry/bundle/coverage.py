"""What the pictures did not show: tilts, corners, distances, pairs of views."""

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.adjust import Adjusted
from rig.geometry.bundle.result import Reason
from rig.geometry.rig_geometry import RigGeometry

_LEAST_TILT_DEG = 15.0
_LEAST_RANGE = 1.4
_FEWEST_SHARED = 8
_CORNER_SHARE = 0.25
"""A corner of the picture reaches this share of its width and height."""


def find_gaps(adjusted: Adjusted, geometry: RigGeometry) -> list[Reason]:
    """Name what the pictures left out, worst first."""
    return [
        *_square_on(adjusted),
        *_short_range(adjusted),
        *_few_shared(adjusted, geometry),
        *_empty_corners(adjusted, geometry),
    ]


def _square_on(adjusted: Adjusted) -> list[Reason]:
    """Focal length and distance cannot be told apart by boards that all look straight on.

    Known moves along the axis tell them as well, so a stage makes tilts unnecessary.
    """
    normal = np.clip(np.abs(adjusted.at.board_rotation[:, 2, 2]), 0.0, 1.0)
    tilt_deg = float(np.percentile(np.degrees(np.arccos(normal)), 90))
    if tilt_deg >= _LEAST_TILT_DEG or adjusted.at.stage is not None:
        return []
    return [
        Reason(
            "square-on",
            f"all boards are square-on (nine of ten tilted by less than {tilt_deg:.0f} degrees); "
            "tilt the board by 20 to 40 degrees to all sides",
        )
    ]


def _short_range(adjusted: Adjusted) -> list[Reason]:
    at, target = adjusted.at, adjusted.problem.target
    middle = at.board_shift_mm + at.board_rotation @ [*target.centre_mm, 0.0]
    near_mm, far_mm = float(middle[:, 2].min()), float(middle[:, 2].max())
    if far_mm >= _LEAST_RANGE * near_mm:
        return []
    return [
        Reason(
            "depth-range",
            f"depth range too short: all boards are between {near_mm:.0f} and {far_mm:.0f} mm; "
            f"bring some nearer and some beyond {_LEAST_RANGE * near_mm:.0f} mm",
        )
    ]


def _few_shared(adjusted: Adjusted, geometry: RigGeometry) -> list[Reason]:
    observed = adjusted.problem.observed
    shows = np.zeros((len(observed.pictures), len(geometry.names)), np.bool_)
    shows[observed.picture, observed.view] = True
    if len(geometry.names) == 1:
        return []
    shared = [
        int((shows[:, view] & np.delete(shows, view, axis=1).any(axis=1)).sum())
        for view in range(len(geometry.names))
    ]
    few = [
        f"{name} ({count})"
        for name, count in zip(geometry.names, shared, strict=True)
        if count < _FEWEST_SHARED
    ]
    if not few:
        return []
    return [
        Reason(
            "few-pictures",
            f"too few pictures are shared with another view by {', '.join(few)}; take at least "
            f"{_FEWEST_SHARED} that show the board to two views at once",
        )
    ]


def _empty_corners(adjusted: Adjusted, geometry: RigGeometry) -> list[Reason]:
    observed = adjusted.problem.observed
    used = adjusted.weight > 0
    empty: list[str] = []
    for view, camera in enumerate(geometry.cameras):
        own = used & (observed.view == view)[observed.sighting_of_point]
        missing = missing_corners(observed.xy_px[own] / (camera.width_px, camera.height_px))
        if missing:
            empty.append(f"{geometry.names[view]} ({', '.join(missing)})")
    return [no_board_in("; ".join(empty))] if empty else []


def missing_corners(places: Float) -> list[str]:
    """Name the corners of the picture in which no point lies.

    Args:
        places: (N, 2) of points, in shares of width and height.
    """
    x, y = places.T
    left, right = x < _CORNER_SHARE, x > 1 - _CORNER_SHARE
    top, bottom = y < _CORNER_SHARE, y > 1 - _CORNER_SHARE
    corners = {
        "top left": left & top,
        "top right": right & top,
        "bottom left": left & bottom,
        "bottom right": right & bottom,
    }
    return [name for name, inside in corners.items() if not inside.any()]


def no_board_in(where: str) -> Reason:
    """Return what it means that some corners show no board."""
    return Reason(
        "corners",
        f"no board in the corners of {where}: the lens is guessed there; show the board there",
    )
