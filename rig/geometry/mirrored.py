"""Views whose pictures are mirrored: by the driver of a webcam, or by a mirror before the lens."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.geometry.half_turn import (
    HALF_TURN,
    Rotations,
    first_rotations,
    shared_pictures,
    spread_rad,
)
from rig.geometry.sighting import Sighting

_FEWEST = 3
"""Pictures of two views before their agreement says anything."""
_AGREED_RAD = np.radians(6.0)
"""First guesses of cameras turn boards by some degrees; two views that differ by less agree."""
_CLEARLY = 3.0
"""As they come, they must differ by so many times as much..."""
_LEAST_RAD = np.radians(0.1)
"""...as at least this: of boards that do not turn, only rounding would speak."""


def refuse_mirrored(
    sightings: Sequence[Sighting],
    points_mm: Float,
    sizes_px: Sequence[tuple[int, int]],
    names: Sequence[str],
    *,
    has_one_way_up: bool,
) -> None:
    """Refuse pictures that agree with those of the other views only after they are mirrored back.

    A checkerboard in a mirrored picture is a checkerboard as well. What it cannot do is to turn as
    the others see it turn: the rotation between two views is the same in all pictures only if both
    are mirrored, or none is. Where as many views are mirrored as not, those after the first that
    differ from it are named.

    Args:
        sightings: of one board.
        points_mm: (P, 3) points of the board.
        sizes_px: (width, height) of each view.
        names: of each view.
        has_one_way_up: whether the board looks different after half a turn.

    Raises:
        CalibrationError: pictures of a view are mirrored.
    """
    as_they_come = first_rotations(sightings, points_mm, sizes_px)
    partner = _mirrored_points(points_mm)
    if partner is None:
        return  # nobody takes such a board for itself in a mirror
    back = first_rotations(
        [_mirrored_back(s, partner, sizes_px[s.view][0]) for s in sightings], points_mm, sizes_px
    )
    one_way = (np.eye(3),) if has_one_way_up else (np.eye(3), HALF_TURN)
    unlike: list[list[int]] = [[] for _ in names]
    counts: list[tuple[int, float, float]] = []
    for view in range(len(names)):
        for other in range(view):
            pictures = shared_pictures(as_they_come, view, other)
            if len(pictures) < _FEWEST:
                continue
            asis_rad = _apart_rad(as_they_come, as_they_come, pictures, view, other, one_way)
            mirrored_rad = _apart_rad(
                back, as_they_come, pictures, view, other, (np.eye(3), HALF_TURN)
            )
            if mirrored_rad < _AGREED_RAD and asis_rad > _CLEARLY * max(mirrored_rad, _LEAST_RAD):
                unlike[view].append(other)
                unlike[other].append(view)
                counts.append((len(pictures), asis_rad, mirrored_rad))
    if not counts:
        return
    odd = [view for view, others in enumerate(unlike) if 2 * len(others) > len(names) - 1]
    if not 0 < len(odd) < len(names):  # as many one way as the other
        odd = sorted(next(others for others in unlike if others))
    many, asis_rad, mirrored_rad = max(counts)
    first = next(view for view in range(len(names)) if view not in odd)
    raise CalibrationError(
        f"{_listed(names, odd)}: the pictures are mirrored (or those of {names[first]} are): in "
        f"{many} pictures the board turns otherwise than {names[first]} sees it, by "
        f"{np.degrees(asis_rad):.0f} deg, and as it does after mirroring, to "
        f"{np.degrees(mirrored_rad):.1f} deg",
        advice="switch the mirroring off in the camera's driver or settings, or mirror the stored "
        "pictures back; a camera that stands upside down is no hindrance",
    )


def _mirrored_points(points_mm: Float) -> NDArray[np.intp] | None:
    """(P,) the point that lies where each point is after the board is mirrored.

    Left to right, or top to bottom, which is the same but for half a turn; None for a board that
    neither brings onto itself.
    """
    plane = points_mm[:, :2]
    middle = (plane.min(axis=0) + plane.max(axis=0)) / 2
    for way in ((-1.0, 1.0), (1.0, -1.0)):
        mirrored = middle + (plane - middle) * way
        partner = np.argmin(np.linalg.norm(mirrored[:, None] - plane, axis=2), axis=1)
        if np.allclose(plane[partner], mirrored, atol=1e-6 * float(np.ptp(plane))):
            return partner
    return None


def _mirrored_back(sighting: Sighting, partner: NDArray[np.intp], width_px: int) -> Sighting:
    xy_px = sighting.xy_px * (-1.0, 1.0) + (width_px - 1.0, 0.0)
    return replace(sighting, ids=partner[sighting.ids], xy_px=xy_px)


def _apart_rad(
    rotations: Rotations,
    others: Rotations,
    pictures: Sequence[int],
    view: int,
    other: int,
    ways: Sequence[Float],
) -> float:
    """By how much the rotation between two views changes from picture to picture."""
    between = np.stack(
        [
            [rotations[p, view] @ way @ others[p, other].T for way in ways]
            for p in pictures
            if (p, view) in rotations
        ]
    )
    return min(spread_rad(between, one) for one in between.reshape(-1, 3, 3))


def _listed(names: Sequence[str], views: Sequence[int]) -> str:
    return ("view " if len(views) == 1 else "views ") + ", ".join(names[view] for view in views)
