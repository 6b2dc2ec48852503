"""Put unit shapes into the world in the words of a scene: middle, edges, ends, radius."""

import numpy as np
from numpy.typing import NDArray

from rig.profile.world import Vector
from rig_sim.surface import Shape

Array = NDArray[np.float64]
Place = Vector | Array


def rectangle(centre_mm: Place, right_mm: Place, down_mm: Place) -> Shape:
    """Place a rectangle, seen from where `right_mm` is to the right and `down_mm` below.

    Args:
        centre_mm: its middle.
        right_mm: from the middle to the right edge.
        down_mm: from the middle to the lower edge.
    """
    return Shape("rectangle", _frame(centre_mm, right_mm, down_mm))


def ellipse(centre_mm: Place, right_mm: Place, down_mm: Place) -> Shape:
    """Place an ellipse by its half axes; see `rectangle`."""
    return Shape("disk", _frame(centre_mm, right_mm, down_mm))


def ball(centre_mm: Place, radius_mm: float, *, tilt_deg: float = 0.0) -> Shape:
    """Place a sphere; its poles are above and below, tilted to the right; its seam is behind."""
    tilt_rad = np.radians(tilt_deg)
    pole = np.array([np.sin(tilt_rad), -np.cos(tilt_rad), 0.0])
    behind = np.array([0.0, 0.0, 1.0])
    return Shape(
        "sphere", _frame(centre_mm, behind * radius_mm, np.cross(pole, behind) * radius_mm)
    )


def tube(start_mm: Place, end_mm: Place, radius_mm: float) -> Shape:
    """Place an open cylinder between two points; its seam is behind."""
    start, along = np.asarray(start_mm, float), np.subtract(end_mm, start_mm)
    axis = along / np.linalg.norm(along)
    behind = start - (start @ axis) * axis
    behind /= np.linalg.norm(behind)
    frame = _frame(start, behind * radius_mm, np.cross(axis, behind) * radius_mm)
    frame[:3, 2] = along
    return Shape("cylinder", frame)


def box(foot_mm: Vector, size_mm: Vector, *, yaw_deg: float) -> tuple[Shape, Shape, Shape, Shape]:
    """Stand a box on its foot: front, left side, right side and top; the rest is never seen.

    Args:
        foot_mm: middle of its lower face.
        size_mm: width, height, depth.
        yaw_deg: turn about the vertical; positive turns its front to the left.
    """
    yaw_rad = np.radians(yaw_deg)
    half_width, half_height, half_depth = np.asarray(size_mm) / 2.0
    right = np.array([np.cos(yaw_rad), 0.0, -np.sin(yaw_rad)])
    away = np.array([np.sin(yaw_rad), 0.0, np.cos(yaw_rad)])
    down = np.array([0.0, 1.0, 0.0])
    middle = np.asarray(foot_mm) - half_height * down
    return (
        rectangle(middle - half_depth * away, half_width * right, half_height * down),
        rectangle(middle - half_width * right, -half_depth * away, half_height * down),
        rectangle(middle + half_width * right, half_depth * away, half_height * down),
        rectangle(middle - half_height * down, half_width * right, -half_depth * away),
    )


def _frame(origin: Place, x: Place, y: Place) -> Array:
    """(4, 4) with columns x, y, their normal as long as x, and the origin."""
    normal = np.cross(x, y)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1] = x, y
    matrix[:3, 2] = normal / np.linalg.norm(normal) * np.linalg.norm(x)
    matrix[:3, 3] = origin
    return matrix
