"""Which poses of the board would help most, from the covariance."""

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.bundle.adjust import Adjusted
from rig.geometry.bundle.depth_error import DISTANCES_MM, depth_gradient, picture_grid
from rig.geometry.bundle.geometry_of import rodrigues_by_shared
from rig.geometry.bundle.linearise import Linearised, linearise
from rig.geometry.bundle.normal import form, solve
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.result import PoseAdvice
from rig.geometry.bundle.rotations import turns
from rig.geometry.bundle.uncertainty import Uncertainty, picture_information
from rig.geometry.bundle.unknowns import Layout, Unknowns
from rig.geometry.rig_geometry import RigGeometry

_COUNT = 3
_PLACES = (0.15, 0.5, 0.85)
"""Where the board's middle is tried, in shares of the picture."""
_TILTS_DEG = ((0.0, 0.0), (30.0, 0.0), (-30.0, 0.0), (0.0, 30.0), (0.0, -30.0))
_NEARER, _FARTHER = 0.9, 1.3
"""Distances are tried between these multiples of the nearest and the farthest board: the user's
light and focus have shown that boards are found there."""
_FEWEST_POINTS = 12
_LOOKED_AT = 10
"""Candidates judged exactly, the best by a first-order estimate."""


def advise(
    adjusted: Adjusted, uncertainty: Uncertainty, geometry: RigGeometry
) -> tuple[PoseAdvice, ...]:
    """Pick poses one after another, each the one that shrinks the depth error most.

    Greedy design of experiments: with information A_c about the shared unknowns in a picture of
    the candidate, the covariance becomes (C^-1 + A_c)^-1; what counts is the variance of depth
    over the picture, averaged over the headline's distances. Boards of which every sighting shows
    all points are taken for boards that must be seen whole.
    """
    poses, at = _candidates(adjusted, geometry)
    observed = _shown(adjusted, geometry, at)
    if not observed.view.size:
        return ()
    information = _information(adjusted, observed, at) / uncertainty.scale
    wanted = _wanted(geometry, adjusted.problem.layout)
    inverse = solve(uncertainty.covariance, np.eye(len(wanted)))
    if inverse is None:
        return ()
    before = float(np.sum(uncertainty.covariance * wanted))
    covariance = uncertainty.covariance
    chosen: list[PoseAdvice] = []
    for _ in range(_COUNT):
        gain = covariance @ wanted @ covariance
        order = np.argsort(-np.einsum("npq,qp->n", information, gain), kind="stable")[:_LOOKED_AT]
        tried = [solve(inverse + information[n], np.eye(len(wanted))) for n in order]
        left = [float(np.sum(t * wanted)) if t is not None else np.inf for t in tried]
        best = int(np.argmin(left))
        posterior = tried[best]
        if posterior is None:
            break
        covariance, inverse = posterior, inverse + information[order[best]]
        gain_pct = 100 * (1 - np.sqrt(left[best] / before))
        chosen.append(replace(poses[observed.pictures[order[best]]], gain_pct=float(gain_pct)))
    return tuple(chosen)


def _candidates(adjusted: Adjusted, geometry: RigGeometry) -> tuple[list[PoseAdvice], Unknowns]:
    """Poses over a grid of places, distances and tilts, and the unknowns with these boards."""
    target, camera = adjusted.problem.target, geometry.cameras[geometry.reference]
    shares = np.array(list(product(_PLACES, _PLACES)))
    pixels = shares * (camera.width_px, camera.height_px)
    rays = camera.unproject(pixels)
    middle = adjusted.at.board_shift_mm + (adjusted.at.board_rotation @ [*target.centre_mm, 0.0])
    near_mm, far_mm = _NEARER * middle[:, 2].min(), _FARTHER * middle[:, 2].max()
    poses: list[PoseAdvice] = []
    rotations, shifts = [], []
    distances_mm = [float(value) for value in np.geomspace(near_mm, far_mm, 3)]
    places = product(distances_mm, _TILTS_DEG)
    for (distance_mm, tilt), (pixel, (x, y)) in product(places, zip(pixels, rays, strict=True)):
        if not np.isfinite(x + y):
            continue
        rotation = turns(np.radians([*tilt, 0.0]))
        middle = np.array([x, y, 1.0]) * distance_mm
        centre_px = (float(pixel[0]), float(pixel[1]))
        poses.append(PoseAdvice(distance_mm, centre_px, tilt, 0.0))
        rotations.append(rotation)
        shifts.append(middle - rotation @ [*target.centre_mm, 0.0])
    at = replace(
        adjusted.at,
        board_rotation=np.stack(rotations),
        board_shift_mm=np.stack(shifts),
        stage=None,
        motion=None,
    )
    return poses, at


class _Shown(NamedTuple):
    """What a view would show of a candidate."""

    picture: int
    """Index of the candidate."""
    view: int
    ids: NDArray[np.intp]


def _shown(adjusted: Adjusted, geometry: RigGeometry, at: Unknowns) -> Observations:
    """Sightings of the candidates that at least two views show."""
    problem = adjusted.problem
    points = problem.target.bent_mm(at.warp_mm)
    whole = np.diff(problem.observed.start).min() == len(points)
    fewest = len(points) if whole else _FEWEST_POINTS
    sightings: list[_Shown] = []
    for n, (rotation, shift) in enumerate(zip(at.board_rotation, at.board_shift_mm, strict=True)):
        own = [
            _Shown(n, view, ids)
            for view, camera in enumerate(geometry.cameras)
            if (
                ids := np.flatnonzero(
                    _inside(
                        geometry.project(view, points @ rotation.T + shift),
                        camera.width_px,
                        camera.height_px,
                    )
                )
            ).size
            >= fewest
        ]
        if len(own) >= 2 or (own and len(geometry.names) == 1):
            sightings += own
    return _observations(sightings, _typical_sigma_px(adjusted, len(geometry.names)))


def _inside(xy_px: Float, width_px: int, height_px: int) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        return np.all((xy_px > 0) & (xy_px < (width_px - 1, height_px - 1)), axis=1)


def _typical_sigma_px(adjusted: Adjusted, views: int) -> Float:
    view = adjusted.problem.observed.view[adjusted.problem.observed.sighting_of_point]
    sigma_px = adjusted.scatter.sigma_px
    return np.array([float(np.median(sigma_px[view == v])) for v in range(views)])


def _observations(sightings: list[_Shown], sigma_px: Float) -> Observations:
    pictures = sorted({shown.picture for shown in sightings})
    ids = [shown.ids for shown in sightings]
    views = np.array([shown.view for shown in sightings], np.int64)
    count = sum(map(len, ids))
    return Observations(
        pictures=tuple(pictures),
        start=np.concatenate([[0], np.cumsum([len(i) for i in ids])]).astype(np.int64),
        picture=np.array([pictures.index(shown.picture) for shown in sightings], np.int64),
        view=views,
        ids=np.concatenate([*ids, np.empty(0, np.intp)]).astype(np.int64),
        xy_px=np.zeros((count, 2)),
        sigma_px=np.repeat(sigma_px[views], list(map(len, ids))),
    )


def _information(adjusted: Adjusted, observed: Observations, at: Unknowns) -> Float:
    """(N, P, P) what each candidate would tell about the shared unknowns."""
    problem = adjusted.problem
    kept = replace(
        at,
        board_rotation=at.board_rotation[list(observed.pictures)],
        board_shift_mm=at.board_shift_mm[list(observed.pictures)],
    )
    linear = linearise(observed, problem.target, kept)
    linear = Linearised(np.zeros_like(linear.residual_px), linear.jacobian)
    weight = observed.sigma_px**-2.0
    normal = form(observed, problem.target, kept, problem.layout, linear, weight, None)
    reduced = normal.reduced()
    return picture_information(normal, reduced) if reduced else np.zeros_like(normal.shared)


def _wanted(geometry: RigGeometry, layout: Layout) -> Float:
    """(P, P) weights W with trace(C W) the relative variance of depth, over all distances."""
    camera = geometry.cameras[geometry.reference]
    grid = picture_grid(camera.width_px, camera.height_px)
    wanted = np.zeros((layout.count, layout.count))
    count = geometry.parameter_count
    for distance_mm in DISTANCES_MM:
        gradient = depth_gradient(geometry, distance_mm, grid) / distance_mm
        gradient = gradient[np.isfinite(gradient).all(axis=1)] @ rodrigues_by_shared(geometry)
        if len(gradient):
            wanted[:count, :count] += gradient.T @ gradient / len(gradient)
    return wanted
