"""All sightings as flat arrays, ordered by picture and view."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.errors import CalibrationError, ConfigError
from rig.geometry.sighting import Sighting

Int = NDArray[np.int64]

FEWEST_POINTS = 6
"""A sighting of fewer points says little more than its own board pose."""
THINNEST = 0.05
"""Spread of a sighting's points across over along: points of one row give no pose."""


@dataclass(frozen=True, slots=True)
class Observations:
    """M points in S sightings of N pictures."""

    pictures: tuple[int, ...]
    """N picture numbers, rising."""
    start: Int
    """(S + 1,) where each sighting's points begin."""
    picture: Int
    """(S,) index into `pictures`."""
    view: Int
    """(S,)."""
    ids: Int
    """(M,) point numbers."""
    xy_px: Float
    """(M, 2)."""
    sigma_px: Float
    """(M,) as the detector told them."""

    @property
    def sighting_of_point(self) -> Int:
        """(M,) which sighting each point belongs to."""
        return np.repeat(np.arange(len(self.view)), np.diff(self.start))

    def points(self, sighting: int) -> slice:
        """Where the points of one sighting are."""
        return slice(int(self.start[sighting]), int(self.start[sighting + 1]))

    def of_pictures(self, kept: NDArray[np.bool_]) -> "Observations":
        """Return only what (N,) kept pictures show."""
        sightings = np.flatnonzero(kept[self.picture])
        rows = np.concatenate([np.arange(self.start[s], self.start[s + 1]) for s in sightings])
        counts = np.diff(self.start)[sightings]
        return Observations(
            pictures=tuple(n for n, keep in zip(self.pictures, kept, strict=True) if keep),
            start=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            picture=(np.cumsum(kept) - 1)[self.picture[sightings]],
            view=self.view[sightings],
            ids=self.ids[rows],
            xy_px=self.xy_px[rows],
            sigma_px=self.sigma_px[rows],
        )


def observe(sightings: Sequence[Sighting], points_mm: Float, view_count: int) -> Observations:
    """Order sightings by picture, view and point, whatever order they came in.

    Sightings of fewer than `FEWEST_POINTS` points, or of a single row, are left out.

    Args:
        sightings: in any order.
        points_mm: (P, 3) of the target.
        view_count: V.

    Raises:
        ConfigError: a view or point that does not exist, or a sighting that is there twice.
        CalibrationError: nothing is left.
    """
    for sighting in sightings:
        if not 0 <= sighting.view < view_count:
            raise ConfigError(
                f"sighting of view {sighting.view} given, views are 0..{view_count - 1}",
                advice="give sightings of this rig",
            )
        if len(sighting) and int(sighting.ids.max()) >= len(points_mm):
            raise ConfigError(
                f"picture {sighting.picture} of view {sighting.view} shows point "
                f"{int(sighting.ids.max())}, the target has points 0..{len(points_mm) - 1}",
                advice="give the target that was detected",
            )
    used = sorted(
        (s for s in sightings if _spans_a_plane(s, points_mm)), key=lambda s: (s.picture, s.view)
    )
    if not used:
        raise CalibrationError(
            f"{len(sightings)} sightings given, none of at least {FEWEST_POINTS} points in two "
            "rows",
            advice="take pictures that show more of the board",
        )
    places = [(s.picture, s.view) for s in used]
    twice = next((a for a, b in pairwise(places) if a == b), None)
    if twice:
        raise ConfigError(
            f"picture {twice[0]} of view {twice[1]} given twice", advice="give each sighting once"
        )
    pictures = sorted({s.picture for s in used})
    index = {picture: row for row, picture in enumerate(pictures)}
    orders = [np.argsort(s.ids) for s in used]
    return Observations(
        pictures=tuple(pictures),
        start=np.concatenate([[0], np.cumsum([len(s) for s in used])]).astype(np.int64),
        picture=np.array([index[s.picture] for s in used], np.int64),
        view=np.array([s.view for s in used], np.int64),
        ids=np.concatenate([s.ids[o] for s, o in zip(used, orders, strict=True)]).astype(np.int64),
        xy_px=np.concatenate([s.xy_px[o] for s, o in zip(used, orders, strict=True)]),
        sigma_px=np.concatenate([s.sigma_px[o] for s, o in zip(used, orders, strict=True)]),
    )


def _spans_a_plane(sighting: Sighting, points_mm: Float) -> bool:
    if len(sighting) < FEWEST_POINTS:
        return False
    plane = points_mm[sighting.ids, :2]
    spread = np.cov((plane - plane.mean(axis=0)).T)
    thin = 0.5 * (np.trace(spread) - np.hypot(spread[0, 0] - spread[1, 1], 2 * spread[0, 1]))
    return bool(thin > THINNEST**2 * (np.trace(spread) - thin))
