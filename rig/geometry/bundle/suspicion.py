"""Bad data by its name: swapped, moved, late, blurred, or a board that is not what was told."""

from collections.abc import Sequence

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.adjust import Adjusted
from rig.geometry.bundle.agreement import Pair, blame, compare_views, find_step
from rig.geometry.bundle.alone import Alone, fit_alone
from rig.geometry.bundle.result import Reason
from rig.geometry.bundle.start_cameras import BoardPoints, board_misfit, board_pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.way_up import turned_reference

_BLURRED = 2.0
"""Sightings so many times as noisy as the others of their view are blurred."""
_HARMLESS_SHARE = 1e-3
"""Of the disparity at the distance of the headline: what moves points by less costs less depth than
that, however sure it is, and the fits of corners miss by about as much on small, steep boards."""
_HARMLESS_MM = 1000.0
_FINEST_PX, _COARSEST_PX = 0.03, 0.1
"""Bounds of that where views are close together or far apart."""
_LATE_SHARE = 0.4
"""A view that disagrees in more than this share of its pictures is not synchronised; fewer are
single pictures in which something moved."""
_SWAP_GAIN = 0.1
"""Views were swapped if that leaves less than this share of the misfit."""
_SQUARE_SHARE = 0.005
"""Difference of the board's scale from the stage's that no lead screw explains."""
_SIGMAS = 5.0


def find_bad_data(adjusted: Adjusted, geometry: RigGeometry, steps: Float | None) -> list[Reason]:
    """Name what is wrong with the data, worst first.

    Args:
        adjusted: the solve.
        geometry: what it found.
        steps: (V, 2) where the profile places the views.
    """
    alone = fit_alone(adjusted)
    least_px = _harmless_px(geometry)
    pairs = compare_views(adjusted.problem.observed, alone, least_px)
    swapped, kept = _swapped_pictures(adjusted, geometry, pairs)
    reasons = swapped_layout(geometry, steps) if steps is not None else []
    reasons += swapped
    reasons += _moved(adjusted, geometry, kept)
    explained = {sighting for pair in pairs if pair.apart for sighting in pair.sightings}
    reasons += _blurred(adjusted, geometry, alone, explained, least_px)
    return reasons + wrong_square(geometry)


def _harmless_px(geometry: RigGeometry) -> float:
    """How far points may be off without a word."""
    centres = geometry.centres_mm()
    widest_mm = float(np.linalg.norm(centres - centres[geometry.reference], axis=1).max())
    disparity_px = geometry.cameras[geometry.reference].fx_px * widest_mm / _HARMLESS_MM
    return float(np.clip(_HARMLESS_SHARE * disparity_px, _FINEST_PX, _COARSEST_PX))


def swapped_layout(geometry: RigGeometry, steps: Float) -> list[Reason]:
    """Two views whose places, compared with the profile's, fit better the other way round."""
    centres = geometry.centres_mm()
    steps = np.asarray(steps, np.float64)
    places = (centres - centres[geometry.reference])[:, :2]
    wanted = steps - steps[geometry.reference]
    best: tuple[float, int, int] | None = None
    asis = _likeness(places, wanted)
    for one in range(len(steps)):
        for other in range(one + 1, len(steps)):
            order = np.arange(len(steps))
            order[[one, other]] = other, one
            # The pictures of the other view were taken for the reference: all places move along.
            moved = wanted[order] - wanted[order][geometry.reference]
            like = _likeness(places, moved)
            if like > asis + 0.1 and (best is None or like > best[0]):
                best = (like, one, other)
    turned = turned_reference(geometry, steps)
    if turned is not None:
        return [Reason("turned", turned)]
    if best is None:
        return []
    names = geometry.names
    return [
        Reason(
            "swapped",
            f"{names[best[1]]} and {names[best[2]]} are swapped: their places fit the profile only "
            "the other way round; exchange the two cameras or their entries in the profile",
        )
    ]


def _likeness(places: Float, wanted: Float) -> float:
    """Cosine between two sets of places, lengths in any unit."""
    sizes = np.sqrt(np.sum(places**2) * np.sum(wanted**2))
    return float(np.sum(places * wanted) / sizes) if sizes > 0 else 1.0


def _swapped_pictures(
    adjusted: Adjusted, geometry: RigGeometry, pairs: Sequence[Pair]
) -> tuple[list[Reason], list[Pair]]:
    """Name pictures in which two views carry each other's name; return the pairs of the others."""
    boards = _boards(adjusted)
    swapped: dict[tuple[int, int], list[int]] = {}
    for pair in pairs:
        if pair.apart and _fits_swapped(geometry, pair, boards):
            swapped.setdefault(pair.views, []).append(pair.picture)
    gone = {picture for pictures in swapped.values() for picture in pictures}
    reasons = [
        Reason(
            "swapped",
            f"{geometry.names[one]} and {geometry.names[other]} are swapped in "
            f"{_listed(adjusted, pictures)}; name the pictures of the two views right",
        )
        for (one, other), pictures in swapped.items()
    ]
    return reasons, [pair for pair in pairs if pair.picture not in gone]


def _boards(adjusted: Adjusted) -> list[BoardPoints]:
    observed = adjusted.problem.observed
    plane = adjusted.problem.target.points_mm[:, :2]
    return [
        BoardPoints(plane[observed.ids[rows]], observed.xy_px[rows])
        for rows in map(observed.points, range(len(observed.view)))
    ]


def _fits_swapped(geometry: RigGeometry, pair: Pair, boards: Sequence[BoardPoints]) -> bool:
    """Whether a pose from one view's pixels fits the other's better after exchanging them."""
    one, other = pair.views
    first, second = (boards[sighting] for sighting in pair.sightings)
    asis = _misfit_across(geometry, one, other, first, second)
    turned = _misfit_across(geometry, one, other, second, first)
    return turned < _SWAP_GAIN * asis


def _misfit_across(
    geometry: RigGeometry, one: int, other: int, first: BoardPoints, second: BoardPoints
) -> float:
    """Rms px in view `other` of the board that view `one` sees."""
    pose = board_pose(geometry.cameras[one], first)
    if pose is None:
        return float("inf")
    across = geometry.cam_from_reference[other] @ geometry.cam_from_reference[one].inverse()
    return board_misfit(geometry.cameras[other], second, across @ pose)


def _moved(adjusted: Adjusted, geometry: RigGeometry, pairs: Sequence[Pair]) -> list[Reason]:
    """Views that were bumped, that are late, or single pictures in which the board moved."""
    reasons: list[Reason] = []
    single: set[int] = set()
    for group in blame(pairs, len(geometry.names)):
        name = " or ".join(geometry.names[view] for view in group)
        own = [pair for pair in pairs if set(group) <= set(pair.views)]
        bad = {pair.picture for pair in own if pair.apart}
        step = find_step(_with_one_partner(own))
        if step is not None:
            number = adjusted.problem.observed.pictures[step]
            reasons.append(
                Reason(
                    "bumped",
                    f"{name} was bumped: from picture {number} on it stands elsewhere; fix it and "
                    "take all pictures again",
                )
            )
        elif len(bad) > _LATE_SHARE * len({pair.picture for pair in own}):
            reasons.append(
                Reason(
                    "unsynchronised",
                    f"{name} is not synchronised: in {len(bad)} pictures it shows the board "
                    "elsewhere than the other views; trigger all views together, or hold the "
                    "board still",
                )
            )
        else:
            single |= bad
    if single:
        reasons.append(
            Reason(
                "moved",
                f"the board moved between the views of {_listed(adjusted, sorted(single))}; take "
                "them again with the board at rest",
            )
        )
    return reasons


def _with_one_partner(pairs: Sequence[Pair]) -> list[Pair]:
    """Return the pairs of the two views that were compared most often."""
    views = [pair.views for pair in pairs]
    most = max(sorted(set(views)), key=views.count)
    return [pair for pair in pairs if pair.views == most]


def _blurred(
    adjusted: Adjusted,
    geometry: RigGeometry,
    alone: Alone,
    explained: set[int],
    least_px: float,
) -> list[Reason]:
    observed = adjusted.problem.observed
    worst = (alone.noise_ratio > _BLURRED) & (alone.scatter_px > least_px)
    worst[list(explained)] = False
    if not worst.any():
        return []
    pictures = sorted(set(observed.picture[worst].tolist()))
    times = float(np.median(alone.noise_ratio[worst]))
    noise_px = float(np.nanmedian(alone.noise_px))
    views = [geometry.names[view] for view in sorted(set(observed.view[worst].tolist()))]
    where = "" if len(views) == len(geometry.names) else f" of {', '.join(views)}"
    return [
        Reason(
            "blurred",
            f"{_listed(adjusted, pictures)}{where} scatter {times:.1f} times as much as the others "
            f"({noise_px:.3f} px): blurred by motion or focus; take them again",
        )
    ]


def wrong_square(geometry: RigGeometry) -> list[Reason]:
    """A board whose squares are not what was told, against the stage's millimetres."""
    stage = geometry.stage
    if stage is None:
        return []
    sigma = float(np.sqrt(stage.covariance[2, 2]))
    off = stage.scale - 1.0
    if abs(off) < max(_SQUARE_SHARE, _SIGMAS * sigma):
        return []
    size = 100.0 / stage.scale
    printed = f"the board was printed at {size:.1f} %" if 90 < size < 100 else "the square is wrong"
    return [
        Reason(
            "square-size",
            f"by the stage's millimetres the squares have {size:.2f} +- {200 * sigma:.2f} % of the "
            f"size given: {printed}, or the stage's steps per mm are; measure the board with a "
            "ruler over many squares and set what it has",
        )
    ]


def _listed(adjusted: Adjusted, pictures: Sequence[int]) -> str:
    numbers = [str(adjusted.problem.observed.pictures[index]) for index in pictures]
    shown = ", ".join(numbers[:8]) + (f" and {len(numbers) - 8} more" if len(numbers) > 8 else "")
    return f"picture{'s' if len(numbers) > 1 else ''} {shown}"
