"""How sure a geometry is of where lines run: across them no depth hides an error."""

import numpy as np

from rig.arrays import Float
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.rays import derivatives, misfit
from rig.geometry.rig_geometry import RigGeometry

_COLUMNS, _ROWS = 7, 5


def grid_features(geometry: RigGeometry, inverse_per_mm: Float) -> SceneFeatures:
    """Return what every view shows of points all over the reference's picture.

    Args:
        geometry: the rig.
        inverse_per_mm: (K,) inverse depths of the points; each place has all of them.
    """
    camera = geometry.cameras[geometry.reference]
    x, y = np.meshgrid(
        np.linspace(0.0, camera.width_px - 1.0, _COLUMNS),
        np.linspace(0.0, camera.height_px - 1.0, _ROWS),
    )
    pixels = np.tile(np.stack([x.ravel(), y.ravel()], axis=1), (len(inverse_per_mm), 1))
    inverse = np.repeat(inverse_per_mm, x.size)
    rays = np.ones((len(pixels), 3))
    rays[:, :2] = camera.unproject(pixels)
    view_px = np.full((len(pixels), len(geometry.cameras), 2), np.nan)
    for view, (other, pose) in enumerate(
        zip(geometry.cameras, geometry.cam_from_reference, strict=True)
    ):
        if view == geometry.reference:
            continue
        seen_px = other.project(rays @ pose.rotation.T + inverse[:, None] * pose.translation_mm)
        size_px = np.array([other.width_px, other.height_px])
        inside = np.all((seen_px > -0.5) & (seen_px < size_px - 0.5), axis=1)
        view_px[inside, view] = seen_px[inside]
    features = SceneFeatures(
        np.zeros(len(pixels), np.intp), pixels, view_px, np.ones(view_px.shape[:2])
    )
    return features[features.shared & np.isfinite(rays[:, 0] + rays[:, 1])]


def rows_sigma_px(geometry: RigGeometry, inverse_per_mm: Float) -> float:
    """Return how far points may lie across their lines, rms over picture and views, 1 sigma.

    Args:
        geometry: with a covariance.
        inverse_per_mm: (K,) of the points.
    """
    features = grid_features(geometry, inverse_per_mm)
    if geometry.covariance is None or not len(features):
        return float("nan")
    moves = derivatives(geometry, features, misfit(geometry, features))
    variance = np.einsum("nvcp,pq,nvcq->nv", moves, geometry.covariance, moves)
    return float(np.sqrt(np.mean(np.maximum(variance[features.seen], 0.0))))
