"""Pairs of views that disagree about where the board was, and what that looks like."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.alone import Alone
from rig.geometry.bundle.observations import Observations

_SIGMAS = 6.0
"""Two views disagree when their poses of the board are so many sigma apart, per degree of
freedom..."""
_TIMES_NOISE = 4.0
"""...and it shows in the picture: their points are apart so many times their noise."""
_FEWEST_POINTS = 12
"""Fewer points leave directions of the pose to noise that linearised sigmas do not tell."""
_STEP_SHARE = 0.3
"""A camera was bumped if two constant places leave less than this share of the disagreement: 0.2
where the intrinsics gave way to it, 0.6 for a view that is late at random."""
_FEWEST_PICTURES = 3
"""Before and after a bump."""


@dataclass(frozen=True, slots=True)
class Pair:
    """What two views say of the board in one picture."""

    picture: int
    """Index of the picture."""
    views: tuple[int, int]
    sightings: tuple[int, int]
    motion: Float
    """(6,) second view's motion minus the first's."""
    information: Float
    """(6, 6) of that difference."""
    apart: bool
    """Whether they disagree."""


def compare_views(observed: Observations, alone: Alone, least_px: float) -> list[Pair]:
    """Compare all pairs of views in every picture.

    Args:
        observed: the points.
        alone: where each view puts the board.
        least_px: views whose points are apart by less, rms, agree.
    """
    pairs: list[Pair] = []
    size = np.diff(observed.start)
    for picture in range(len(observed.pictures)):
        shown = np.flatnonzero((observed.picture == picture) & (size >= _FEWEST_POINTS))
        for one, other in combinations(shown.tolist(), 2):
            motion = alone.motion[other] - alone.motion[one]
            first, second = alone.information[one], alone.information[other]
            # Inverse of the sum of covariances, without inverting either.
            information = first @ np.linalg.solve(first + second, second)
            square = float(motion @ information @ motion)
            views = (int(observed.view[one]), int(observed.view[other]))
            # How far points are apart, in units of the noise of either view.
            times_noise = np.sqrt(
                [motion @ first @ motion / size[one], motion @ second @ motion / size[other]]
            )
            apart_px = float(np.min(times_noise * alone.noise_px[list(views)]))
            apart = (
                square > 6 * _SIGMAS**2
                and float(times_noise.min()) > _TIMES_NOISE
                and apart_px > least_px
            )
            pairs.append(Pair(picture, views, (one, other), motion, information, apart))
    return pairs


def blame(pairs: Sequence[Pair], view_count: int) -> list[tuple[int, ...]]:
    """Views that explain the disagreements, each alone or, where nothing tells which, two together.

    Takes the view with most bad pairs, leaves its pairs out, and goes on while the rest disagrees.
    """
    guilty: list[tuple[int, ...]] = []
    left = [pair for pair in pairs if pair.apart]
    while left:
        counts = np.zeros(view_count, np.int64)
        for pair in left:
            counts[list(pair.views)] += 1
        most = np.flatnonzero(counts == counts.max()).tolist()
        guilty.append(tuple(most) if len(most) == 2 else (most[0],))
        left = [pair for pair in left if not set(pair.views) & set(guilty[-1])]
    return guilty


def find_step(pairs: Sequence[Pair]) -> int | None:
    """Index of the first picture after a camera was moved; None if no single move explains it.

    Nor where leaving one picture out explains far more: then the board moved in that one.

    Args:
        pairs: of the same two views, in the order of the pictures.
    """
    if len(pairs) < 2 * _FEWEST_PICTURES:
        return None
    whole = _misfit(pairs)
    misfit, place = min(
        (_misfit(pairs[:k]) + _misfit(pairs[k:]), k)
        for k in range(_FEWEST_PICTURES, len(pairs) - _FEWEST_PICTURES + 1)
    )
    if whole <= 6 * _SIGMAS**2 or misfit >= _STEP_SHARE * whole:
        return None
    without = min(_misfit([*pairs[:k], *pairs[k + 1 :]]) for k in range(len(pairs)))
    return pairs[place].picture if without > _STEP_SHARE * misfit else None


def _misfit(pairs: Sequence[Pair]) -> float:
    """Chi-square about the best constant motion."""
    information = np.sum([pair.information for pair in pairs], axis=0)
    pulled = np.sum([pair.information @ pair.motion for pair in pairs], axis=0)
    mean = np.linalg.solve(information, pulled)
    return float(sum((p.motion - mean) @ p.information @ (p.motion - mean) for p in pairs))
