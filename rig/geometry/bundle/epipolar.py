"""How far points are from the epipolar lines of their partners."""

from collections.abc import Sequence
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.result import Residuals
from rig.geometry.bundle.rotations import cross_matrix
from rig.geometry.epipolar_error import EpipolarError
from rig.geometry.rig_geometry import RigGeometry


class ResidualsWithRays(NamedTuple):
    """The residuals of one sighting, and the undistorted rays of its points."""

    residuals: Residuals
    rays: Float
    """(N, 3)."""


class _Lines(NamedTuple):
    """What takes rays of one view to lines in another."""

    essential: Float
    """(3, 3)."""
    focal_px: float
    """Of the other view."""


def epipolar_error(geometry: RigGeometry, residuals: Sequence[Residuals]) -> EpipolarError:
    """Measure all pairs of views on the points that both show, outliers left out.

    Distances are in px of an undistorted picture of the second view's focal length, from each view
    of a pair to the other.
    """
    by_picture: dict[int, list[ResidualsWithRays]] = {}
    for one, rays in zip(residuals, _rays(geometry, residuals), strict=True):
        by_picture.setdefault(one.picture, []).append(ResidualsWithRays(one, rays))
    pairs = permutations(range(len(geometry.names)), 2)
    lines = {pair: _lines(geometry, *pair) for pair in pairs}
    distances = [
        _distances(lines[one.residuals.view, other.residuals.view], one, other)
        for shown in by_picture.values()
        for pair in combinations(shown, 2)
        for one, other in (pair, pair[::-1])
    ]
    all_px = np.concatenate(distances) if distances else np.empty(0)
    return EpipolarError.of(all_px[np.isfinite(all_px)])


def _rays(geometry: RigGeometry, residuals: Sequence[Residuals]) -> list[Float]:
    """(N, 3) of each sighting; all of a view are undistorted at once."""
    rays = [np.empty((0, 3))] * len(residuals)
    for view, camera in enumerate(geometry.cameras):
        own = [index for index, one in enumerate(residuals) if one.view == view]
        if own:
            xy = camera.unproject(np.concatenate([residuals[index].xy_px for index in own]))
            ends = np.cumsum([len(residuals[index].ids) for index in own])
            whole = np.concatenate([xy, np.ones((len(xy), 1))], axis=1)
            for index, part in zip(own, np.split(whole, ends[:-1]), strict=True):
                rays[index] = part
    return rays


def _lines(geometry: RigGeometry, one: int, other: int) -> _Lines:
    place = geometry.cam_from_reference[other] @ geometry.cam_from_reference[one].inverse()
    camera = geometry.cameras[other]
    focal_px = (camera.fx_px + camera.fy_px) / 2
    return _Lines(cross_matrix(place.translation_mm) @ place.rotation, focal_px)


def _distances(lines: _Lines, first: ResidualsWithRays, second: ResidualsWithRays) -> Float:
    """(K,) px from the points of `second` to the lines that the points of `first` give there."""
    (one, from_rays), (other, to_rays) = first, second
    _, here, there = np.intersect1d(one.ids, other.ids, assume_unique=True, return_indices=True)
    good = ~(one.outlier[here] | other.outlier[there])
    left, right = from_rays[here[good]] @ lines.essential.T, to_rays[there[good]]
    apart = np.abs(np.sum(left * right, axis=1)) / np.hypot(left[:, 0], left[:, 1])
    return apart * lines.focal_px
