"""How far the middle of a circle's picture lies from the picture of its centre.

A circle on a tilted board appears as an ellipse, and half of it is nearer: the ellipse's middle is
not where the centre appears. J. Heikkilä, "Geometric camera calibration using circular control
points", IEEE TPAMI 22(10), 2000, gives the difference for a pinhole. Here the edge of the circle
is carried through the whole camera, so that the lens takes part.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.arrays import Float
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting

_EDGE_POINTS = 48


def centre_bias_px(
    camera: CameraModel, camera_from_board: Pose, centres_mm: Float, diameter_mm: float
) -> Float:
    """Return the middles of the circles' pictures less the pictures of their centres (N, 2), px.

    Args:
        camera: which sees them.
        camera_from_board: pose of the board.
        centres_mm: (N, 3) on the board, z = 0.
        diameter_mm: of the circles.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, _EDGE_POINTS, endpoint=False)
    # A polygon of the circle's own area: its corners stand a little outside.
    step = 2.0 * np.pi / _EDGE_POINTS
    radius_mm = diameter_mm / 2.0 * np.sqrt(step / np.sin(step))
    edge = radius_mm * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    points_mm = (centres_mm[:, None] + edge).reshape(-1, 3)
    shown = camera.project(camera_from_board.apply(points_mm)).reshape(-1, _EDGE_POINTS, 2)
    centre_px = camera.project(camera_from_board.apply(centres_mm))
    return _centroids(shown - centre_px[:, None])


def without_bias(
    sightings: Sequence[Sighting],
    geometry: RigGeometry,
    boards: dict[int, Pose],
    points_mm: Float,
    diameter_mm: float,
) -> tuple[Sighting, ...]:
    """Return sightings of ellipses as sightings of the centres of their circles.

    Args:
        sightings: middles of ellipses, as they were found.
        geometry: of the cameras.
        boards: reference_from_board by picture; sightings of other pictures are left as they are.
        points_mm: (P, 3) centres on the board.
        diameter_mm: of the circles.
    """
    return tuple(
        replace(one, xy_px=one.xy_px - bias_px)
        if one.picture in boards and np.isfinite(bias_px).all()
        else one
        for one, bias_px in (
            (one, _bias_of(one, geometry, boards, points_mm, diameter_mm)) for one in sightings
        )
    )


def _bias_of(
    one: Sighting,
    geometry: RigGeometry,
    boards: dict[int, Pose],
    points_mm: Float,
    diameter_mm: float,
) -> Float:
    if one.picture not in boards:
        return np.zeros_like(one.xy_px)
    pose = geometry.cam_from_reference[one.view] @ boards[one.picture]
    return centre_bias_px(geometry.cameras[one.view], pose, points_mm[one.ids], diameter_mm)


def _centroids(polygons: Float) -> Float:
    """(N, 2) centroids of polygons (N, K, 2), by the shoelace formula."""
    after = np.roll(polygons, -1, axis=1)
    cross = polygons[..., 0] * after[..., 1] - polygons[..., 1] * after[..., 0]
    area = cross.sum(axis=1)
    return ((polygons + after) * cross[..., None]).sum(axis=1) / (3.0 * area[:, None])
