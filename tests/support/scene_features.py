"""Features of a scene in closed form: points before cameras, projected, with noise and mistakes."""

import numpy as np

from rig.arrays import Float
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.rays import misfit
from rig.epipolar.scene.rows import grid_features
from rig.epipolar.scene.solve import across_px
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry


def row_of(
    *turns_deg: tuple[float, float, float],
    focal_px: tuple[float, ...] | None = None,
    coefficients: tuple[float, ...] = (),
) -> RigGeometry:
    """Return cameras of 640 x 480 px, 75 mm apart; those behind the first are turned."""
    count = 1 + len(turns_deg)
    focals_px = focal_px or (450.0,) * count
    lens = "brown5" if coefficients else "none"
    cameras = tuple(
        CameraModel(640, 480, f, f, 319.5, 239.5, lens, coefficients) for f in focals_px
    )
    places = tuple(
        Pose.from_vectors(np.radians(turn), np.array([-75.0 * (k + 1), 0.0, 0.0]))
        for k, turn in enumerate(turns_deg)
    )
    names = ("left", "right", "far")[:count]
    return RigGeometry(names, 0, cameras, (Pose.identity(), *places))


def features_of(
    geometry: RigGeometry,
    seed: int,
    count: int = 400,
    *,
    depths_mm: tuple[float, float] = (600.0, 6000.0),
    noise_px: float = 0.0,
    wrong: float = 0.0,
) -> SceneFeatures:
    """Return points all over the reference's picture as every view shows them.

    Args:
        geometry: the true rig.
        seed: of places, noise and mistakes.
        count: of points that all views show.
        depths_mm: nearest and farthest; their inverses are spread evenly.
        noise_px: 1 sigma of every coordinate.
        wrong: share of matches that lie anywhere.
    """
    random = np.random.default_rng(seed)
    camera = geometry.cameras[geometry.reference]
    size = np.array([camera.width_px, camera.height_px])
    pixels = random.uniform(0.02, 0.98, (4 * count, 2)) * size
    inverse = random.uniform(1.0 / depths_mm[1], 1.0 / depths_mm[0], 4 * count)
    rays = np.ones((4 * count, 3))
    rays[:, :2] = camera.unproject(pixels)
    view_px = np.full((4 * count, len(geometry.cameras), 2), np.nan)
    for view in range(len(geometry.cameras)):
        if view != geometry.reference:
            view_px[:, view] = geometry.project(view, rays / inverse[:, None])
    others = np.delete(view_px, geometry.reference, axis=1)
    inside = np.all((others > 0.0) & (others < size), axis=(1, 2))
    chosen = np.flatnonzero(inside)[:count]
    view_px = view_px[chosen] + noise_px * random.standard_normal((len(chosen), *view_px.shape[1:]))
    mistaken = random.random(len(chosen)) < wrong
    view_px[mistaken] = np.where(
        np.isfinite(view_px[mistaken]), random.uniform(0, 1, view_px[mistaken].shape) * size, np.nan
    )
    return SceneFeatures(
        np.zeros(len(chosen), np.intp), pixels[chosen], view_px, np.ones(view_px.shape[:2])
    )


def rows_missed_px(
    found: RigGeometry, true: RigGeometry, depths_mm: tuple[float, ...] = (600.0, 1000.0, 3000.0)
) -> Float:
    """(N,) by how much points of the true rig lie across the lines of the one that was found."""
    exact = grid_features(true, 1.0 / np.array(depths_mm))
    across = across_px(misfit(found, exact), exact)
    return across[np.isfinite(across)]
