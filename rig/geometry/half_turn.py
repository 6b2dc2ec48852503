"""Which way up each view has taken a board that looks the same after half a turn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.geometry.bundle.start_cameras import BoardPoints, board_pose, guess_camera
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting

Rotations = Mapping[tuple[int, int], Float]
"""(3, 3) cam_from_board by picture and view."""

HALF_TURN = np.diag([-1.0, -1.0, 1.0])
_APART_RAD = np.radians(40.0)
"""Rotations between two views further apart than this are two answers, not one."""
_CLEARLY = 2.0
"""The wrong answer must disagree with itself so many times as much as the right one."""
_LEAST_RAD = np.radians(2.0)


def agree_on_turns(
    sightings: Sequence[Sighting],
    points_mm: Float,
    sizes_px: Sequence[tuple[int, int]],
    names: Sequence[str],
) -> tuple[Sighting, ...]:
    """Turn sightings by half a turn where another view of the same picture needs it.

    The views do not move against each other: of the two ways in which a pair of views may have
    taken a picture's board, that one is right which gives the same rotation between the views in
    all pictures.

    Args:
        sightings: of one board, numbered the same after half a turn: point i becomes P - 1 - i.
        points_mm: (P, 3) points of the board.
        sizes_px: (width, height) of each view.
        names: of each view.

    Raises:
        CalibrationError: the pictures fit both ways, because the board never turns in them.
    """
    turned = first_rotations(sightings, points_mm, sizes_px)
    flipped: dict[tuple[int, int], bool] = {}
    settled: list[int] = []
    waiting = list(range(len(names)))
    while waiting:
        shared = [
            (len(shared_pictures(turned, view, other)), -view, -other)
            for view in waiting
            for other in settled
        ]
        count, view, other = max(shared, default=(0, -waiting[0], 0))
        view, other = -view, -other
        turns = _turns_between(turned, flipped, view, other, names) if count else {}
        for picture in (p for p, v in turned if v == view):
            flipped[picture, view] = turns.get(picture, False)
        waiting.remove(view)
        settled.append(view)
    last = len(points_mm) - 1
    return tuple(
        replace(s, ids=last - s.ids) if flipped.get((s.picture, s.view)) else s for s in sightings
    )


def agree_by_geometry(
    sightings: Sequence[Sighting], points_mm: Float, geometry: RigGeometry
) -> tuple[Sighting, ...]:
    """Turn the sightings of one picture by half a turn where the geometry of the rig needs it.

    Args:
        sightings: of one picture, of a board as `agree_on_turns` takes it.
        points_mm: (P, 3) points of the board.
        geometry: of the rig; cameras may have moved since by less than half a board.
    """
    if not sightings:
        return ()
    first, *others = sightings
    board = BoardPoints(points_mm[first.ids, :2], first.xy_px)
    seen = board_pose(geometry.cameras[first.view], board)
    if seen is None:
        return tuple(sightings)
    pose = geometry.cam_from_reference[first.view].inverse() @ seen
    last = len(points_mm) - 1
    agreed = [first]
    for other in others:
        ways = (other, replace(other, ids=last - other.ids))
        agreed.append(min(ways, key=lambda way: _misfit_px(geometry, points_mm, pose, way)))
    return tuple(agreed)


def _misfit_px(geometry: RigGeometry, points_mm: Float, pose: Pose, way: Sighting) -> float:
    away_px = geometry.project(way.view, pose.apply(points_mm[way.ids])) - way.xy_px
    return float(np.linalg.norm(np.nan_to_num(away_px, nan=1e6)))


def first_rotations(
    sightings: Sequence[Sighting], points_mm: Float, sizes_px: Sequence[tuple[int, int]]
) -> Rotations:
    """Rotations of the boards, from first guesses of the cameras; without those that fit none."""
    rotations: dict[tuple[int, int], Float] = {}
    for view, size_px in enumerate(sizes_px):
        own = [s for s in sightings if s.view == view]
        if not own:
            continue
        boards = [BoardPoints(points_mm[s.ids, :2], s.xy_px) for s in own]
        camera = guess_camera(boards, size_px, "none").camera
        for sighting, board in zip(own, boards, strict=True):
            pose = board_pose(camera, board)
            if pose is not None:
                rotations[sighting.picture, view] = pose.rotation
    return rotations


def shared_pictures(rotations: Rotations, view: int, other: int) -> list[int]:
    """Pictures in which both views show the board."""
    return sorted(p for p, v in rotations if v == view and (p, other) in rotations)


@dataclass(frozen=True, slots=True)
class _Answer:
    """One rotation between two views, and how well all pictures agree with it."""

    rotation: Float
    spread_rad: float


def _turns_between(
    rotations: Rotations,
    flipped: dict[tuple[int, int], bool],
    view: int,
    other: int,
    names: Sequence[str],
) -> dict[int, bool]:
    """By picture, whether `view` took the board half a turn away from what `other` did."""
    pictures = shared_pictures(rotations, view, other)
    both = np.stack(
        [
            [rotations[p, view] @ turn @ _settled(rotations, flipped, p, other).T for turn in turns]
            for p in pictures
            for turns in [(np.eye(3), HALF_TURN)]
        ]
    )
    answers = sorted(
        (_Answer(r, spread_rad(both, r)) for r in both.reshape(-1, 3, 3)),
        key=lambda answer: answer.spread_rad,
    )
    best = answers[0]
    rival = next(
        (a for a in answers if _angles_rad(a.rotation[None], best.rotation)[0] > _APART_RAD), None
    )
    if rival is not None and rival.spread_rad < _CLEARLY * max(best.spread_rad, _LEAST_RAD):
        raise CalibrationError(
            f"views {names[other]} and {names[view]}: the board looks the same after half a turn, "
            f"and {len(pictures)} pictures fit both ways (to "
            f"{np.degrees(best.spread_rad):.1f} and {np.degrees(rival.spread_rad):.1f} deg)",
            advice="tilt "
            "the board to all sides, or use one with an odd and an even number of corners",
        )
    angles = np.stack([_angles_rad(both[:, way], best.rotation) for way in (0, 1)], axis=1)
    return {p: bool(way) for p, way in zip(pictures, angles.argmin(axis=1), strict=True)}


def _settled(
    rotations: Rotations, flipped: dict[tuple[int, int], bool], picture: int, view: int
) -> Float:
    own = rotations[picture, view]
    return own @ HALF_TURN if flipped.get((picture, view)) else own


def spread_rad(ways: Float, rotation: Float) -> float:
    """Median over pictures (N, W, 3, 3) of the angle between a rotation and the nearest way."""
    angles = np.stack([_angles_rad(way, rotation) for way in np.swapaxes(ways, 0, 1)], axis=1)
    return float(np.median(angles.min(axis=1)))


def _angles_rad(rotations: Float, rotation: Float) -> Float:
    """(N,) angles between (N, 3, 3) rotations and one."""
    trace = np.einsum("nij,ij->n", rotations, rotation)
    return np.arccos(np.clip((trace - 1) / 2, -1, 1))
