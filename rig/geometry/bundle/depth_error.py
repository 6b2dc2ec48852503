"""The error of depth that a calibration causes: its covariance, carried through triangulation."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.geometry.bundle.geometry_of import rodrigues_by_shared, unknowns_of
from rig.geometry.bundle.linearise import Target, linearise
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.part import Part, nodes_px
from rig.geometry.bundle.result import DepthError
from rig.geometry.bundle.unknowns import WARP
from rig.geometry.lens import COEFFICIENTS
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

DISTANCES_MM = (500.0, 1000.0, 2000.0, 3000.0)
"""Where the headline is told."""
_COLUMNS, _ROWS = 9, 7


def picture_grid(width_px: int, height_px: int) -> Float:
    """(G, 2) pixels over a whole picture, its corners among them."""
    x, y = np.meshgrid(np.linspace(0, width_px - 1, _COLUMNS), np.linspace(0, height_px - 1, _ROWS))
    return np.stack([x.ravel(), y.ravel()], axis=1)


def depth_errors(
    geometry: RigGeometry, seen: Part | None = None, lit: Part | None = None
) -> tuple[DepthError, ...]:
    """Tell the headline: k = 2 at each of `DISTANCES_MM`, NaN where no two views overlap.

    Args:
        geometry: the rig.
        seen: where boards were seen in the reference view; None for the whole picture.
        lit: where light falls on its picture; None for all of it.

    Raises:
        CalibrationError: the geometry has no covariance.
    """
    camera = geometry.cameras[geometry.reference]
    pixels = nodes_px((camera.width_px, camera.height_px))
    whole = np.ones(pixels.shape[:2], np.bool_) if lit is None else lit
    part = whole if seen is None else seen & whole
    errors: list[DepthError] = []
    for distance_mm in DISTANCES_MM:
        sigma_mm = depth_sigma_mm(geometry, distance_mm, pixels.reshape(-1, 2))
        twice_pct = 200.0 * sigma_mm.reshape(whole.shape) / distance_mm
        errors.append(
            DepthError(
                distance_mm, _rms(twice_pct[part]), _rms(twice_pct[whole]), _most(twice_pct[whole])
            )
        )
    return tuple(errors)


def _rms(values: Float) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def _most(values: Float) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else float("nan")


def depth_sigma_mm(geometry: RigGeometry, distance_mm: float, pixels: Float) -> Float:
    """1 sigma (G,) of depth at pixels (G, 2) of the reference view; NaN where one view sees it.

    Raises:
        CalibrationError: the geometry has no covariance.
    """
    if geometry.covariance is None:
        raise CalibrationError(
            "depth error asked for of a geometry without covariance",
            advice="calibrate the rig instead of importing its numbers",
        )
    gradient = depth_gradient(geometry, distance_mm, pixels)
    variance = np.einsum("gp,pq,gq->g", gradient, geometry.covariance, gradient)
    return np.sqrt(np.maximum(variance, 0.0))


def depth_gradient(
    geometry: RigGeometry,
    distance_mm: float,
    pixels: Float,
    views: Sequence[int] | None = None,
) -> Float:
    """How triangulated depth moves with the parameters of the geometry.

    A point X projects to u = f(X, p) in all views that show it. With u found without error and p
    off by dp, least squares over the views puts it at X + dX, dX = -(J'J)^-1 J' df/dp dp.

    Args:
        geometry: the rig, P parameters.
        distance_mm: depth of the points in the reference view.
        pixels: (G, 2) where the reference view shows them.
        views: which views triangulate; all by default.

    Returns:
        (G, P); NaN for points that fewer than two of the views show.
    """
    used = range(len(geometry.names)) if views is None else views
    xy = geometry.cameras[geometry.reference].unproject(pixels)
    points = np.concatenate([xy, np.ones((len(xy), 1))], axis=1) * distance_mm
    known = np.isfinite(points).all(axis=1)
    points[~known] = (0.0, 0.0, distance_mm)
    normal, mixed = (
        np.zeros((len(points), 3, 3)),
        np.zeros((len(points), 3, geometry.parameter_count)),
    )
    shown = np.zeros(len(points), np.int64)
    for view in used:
        inside = known & _inside(geometry, view, points)
        by_point, by_parameters = _derivatives(geometry, view, points)
        by_point[~inside] = 0.0
        normal += np.einsum("gai,gaj->gij", by_point, by_point)
        mixed += np.einsum("gai,gap->gip", by_point, by_parameters)
        shown += inside
    gradient = np.full((len(points), geometry.parameter_count), np.nan)
    good = shown >= 2
    gradient[good] = -np.linalg.solve(normal[good], mixed[good])[:, 2]
    return np.einsum("gp,pq->gq", gradient, np.linalg.inv(rodrigues_by_shared(geometry)))


def _inside(geometry: RigGeometry, view: int, points_mm: Float) -> NDArray[np.bool_]:
    camera = geometry.cameras[view]
    pixels = geometry.project(view, points_mm)
    size = (camera.width_px - 0.5, camera.height_px - 0.5)
    return np.all((pixels > -0.5) & (pixels < size), axis=1)


def _derivatives(geometry: RigGeometry, view: int, points_mm: Float) -> tuple[Float, Float]:
    """Projection of (G, 3) points by themselves (G, 2, 3) and by turns and shifts (G, 2, P)."""
    count = len(points_mm)
    observed = Observations(
        pictures=(0,),
        start=np.array([0, count]),
        picture=np.zeros(1, np.int64),
        view=np.array([view]),
        ids=np.arange(count),
        xy_px=np.zeros((count, 2)),
        sigma_px=np.ones(count),
    )
    linear = linearise(observed, Target(points_mm), unknowns_of(geometry, [Pose.identity()]))
    longest = max(COEFFICIENTS[camera.lens] for camera in geometry.cameras)
    counts = [4 + COEFFICIENTS[camera.lens] for camera in geometry.cameras]
    by_parameters = np.zeros((count, 2, geometry.parameter_count))
    at = sum(counts[:view])
    by_parameters[:, :, at : at + counts[view]] = linear.jacobian[:, :, : counts[view]]
    if view != geometry.reference:
        place = 4 + longest
        order = view - (view > geometry.reference)
        at = sum(counts) + 6 * order
        by_parameters[:, :, at : at + 6] = linear.jacobian[:, :, place : place + 6]
    pose = 4 + longest + 6 + WARP
    return linear.jacobian[:, :, pose + 3 :].copy(), by_parameters
