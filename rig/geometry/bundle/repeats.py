"""Pictures that show nothing new: the same picture again, or a board that never moves."""

from collections.abc import Sequence

import numpy as np

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.result import Reason

FEWEST_PLACES = 3
"""Places of the board below which cameras cannot be told."""
_SAME_PX = 0.3
"""Corners that move by less, rms, are of a board at the same place."""
_MOST_LISTED = 8

_Points = dict[tuple[int, int], tuple[float, float]]


def require_different_places(observed: Observations) -> None:
    """Refuse pictures of which nearly all show the board at the same place.

    Raises:
        CalibrationError: it is seen at fewer than `FEWEST_PLACES` places.
    """
    count = len(observed.pictures)
    if count < FEWEST_PLACES:
        return  # another message tells that there are too few
    places: list[_Points] = []
    for picture in range(count):
        points = _points(observed, picture)
        if all(_moved_px(points, place) > _SAME_PX for place in places):
            places.append(points)
            if len(places) == FEWEST_PLACES:
                return
    raise CalibrationError(
        f"{count} pictures show the board at {len(places)} place{'s' * (len(places) > 1)} only: "
        f"from one to the next its corners move by less than {_SAME_PX} px",
        advice="move and tilt the board between the pictures",
    )


def repeated(observed: Observations) -> list[Reason]:
    """Name pictures whose points are those of an earlier one to the last digit."""
    first: dict[bytes, int] = {}
    again: list[int] = []
    for index, number in enumerate(observed.pictures):
        key = _bytes(observed, index)
        if key in first:
            again.append(number)
        first.setdefault(key, number)
    if not again:
        return []
    listed = ", ".join(map(str, again[:_MOST_LISTED]))
    more = f" and {len(again) - _MOST_LISTED} more" if len(again) > _MOST_LISTED else ""
    return [
        Reason(
            "repeated",
            f"{len(again)} of {len(observed.pictures)} pictures are earlier ones again (picture"
            f"{'s' * (len(again) > 1)} {listed}{more}): they say nothing new, and make the error "
            "look smaller than it is; leave them out",
        )
    ]


def _points(observed: Observations, picture: int) -> _Points:
    """Pixels by view and point number."""
    return {
        (int(observed.view[s]), number): (x, y)
        for s in np.flatnonzero(observed.picture == picture).tolist()
        for number, (x, y) in zip(
            observed.ids[observed.points(s)].tolist(),
            observed.xy_px[observed.points(s)].tolist(),
            strict=True,
        )
    }


def _moved_px(points: _Points, before: _Points) -> float:
    """Rms distance of the points that both show; infinite for none."""
    both = points.keys() & before.keys()
    if not both:
        return float("inf")
    return _rms([np.subtract(points[key], before[key]) for key in both])


def _rms(away_px: Sequence[Float]) -> float:
    return float(np.sqrt(np.mean(np.sum(np.square(away_px), axis=1))))


def _bytes(observed: Observations, picture: int) -> bytes:
    parts: list[bytes] = []
    for sighting in np.flatnonzero(observed.picture == picture).tolist():
        rows = observed.points(sighting)
        parts += [
            observed.view[sighting].tobytes(),
            observed.ids[rows].tobytes(),
            observed.xy_px[rows].tobytes(),
        ]
    return b"".join(parts)
