"""Whether two geometries are one: by where they put points in the pictures."""

from collections.abc import Sequence

import numpy as np

from rig.errors import FormatError
from rig.geometry.rig_geometry import RigGeometry

_DEPTHS_MM = (300.0, 1000.0, 4000.0)
_GRID = (9, 7)


def aligned(geometry: RigGeometry, names: Sequence[str], reference: str) -> RigGeometry:
    """Return the same cameras in another order, seen from another reference view.

    Files of other tools have their own order and their own first camera. The covariance and the
    stage belong to the old reference and stay behind where that changes.

    Raises:
        FormatError: the views are not the same.
    """
    if sorted(names) != sorted(geometry.names) or reference not in names:
        raise FormatError(
            f"asked for the views {', '.join(names)} with {reference} as reference, found "
            f"{', '.join(geometry.names)}",
            advice="name the views as the file does, or the file's views as the profile does",
        )
    order = [geometry.names.index(name) for name in names]
    old_from_new = geometry.cam_from_reference[geometry.names.index(reference)].inverse()
    same = tuple(names) == geometry.names and reference == geometry.names[geometry.reference]
    return RigGeometry(
        names=tuple(names),
        reference=list(names).index(reference),
        cameras=tuple(geometry.cameras[i] for i in order),
        cam_from_reference=tuple(
            geometry.cam_from_reference[i]
            if same
            else geometry.cam_from_reference[i] @ old_from_new
            for i in order
        ),
        covariance=geometry.covariance if same else None,
        stage=geometry.stage if same else None,
    )


def largest_gap_px(one: RigGeometry, other: RigGeometry) -> float:
    """Largest distance between the pixels of the same points in two geometries, px.

    Points fill every picture of `one` at several depths; both have the same views in one order.
    """
    gap_px = 0.0
    for view, camera in enumerate(one.cameras):
        pixels = np.stack(
            np.meshgrid(
                np.linspace(0.0, camera.width_px - 1.0, _GRID[0]),
                np.linspace(0.0, camera.height_px - 1.0, _GRID[1]),
            ),
            axis=-1,
        ).reshape(-1, 2)
        rays = camera.unproject(pixels)
        rays = np.column_stack([rays, np.ones(len(rays))])[np.isfinite(rays).all(axis=1)]
        reference_from_cam = one.cam_from_reference[view].inverse()
        for depth_mm in _DEPTHS_MM:
            points = reference_from_cam.apply(rays * depth_mm)
            apart = np.linalg.norm(one.project(view, points) - other.project(view, points), axis=1)
            gap_px = max(gap_px, float(np.max(apart, initial=0.0)))
    return gap_px
