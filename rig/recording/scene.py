"""What other programs want to know beside the pictures: cameras, their places, depth. Metres."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False, slots=True)
class CameraInfo:
    """One camera as ROS and Foxglove describe it: the raw picture, and the rectified one."""

    width_px: int
    height_px: int
    lens: str
    """Lens model of the raw picture: `none`, `brown5`, `brown8` or `fisheye`."""
    coefficients: tuple[float, ...]
    """Of the lens, in OpenCV's order."""
    matrix: NDArray[np.float64]
    """(3, 3) camera matrix of the raw picture."""
    rectification: NDArray[np.float64]
    """(3, 3) rotation from the raw camera into the rectified one."""
    projection: NDArray[np.float64]
    """(3, 4) of the rectified picture, for points (m) in the frame of the rectified reference
    view: its last column holds -f times the place of this view."""


@dataclass(frozen=True, slots=True)
class FrameTransform:
    """Where a frame lies in another one."""

    parent: str
    child: str
    translation_m: tuple[float, float, float]
    """Origin of the child in the parent's frame."""
    quaternion: tuple[float, float, float, float]
    """(x, y, z, w) of the rotation that takes the child's vectors to the parent's."""


@dataclass(frozen=True, slots=True)
class Scene:
    """What stays the same during a capture."""

    frame_of: dict[str, str]
    """By view: name of the frame of its rectified camera."""
    reference: str
    """View that the depth is seen by."""
    transforms: tuple[FrameTransform, ...]
    cameras: dict[str, CameraInfo]
    """By view; empty where nothing tells the focal length."""
    depth_camera: CameraInfo | None
    """Of the depth map; None where nothing tells the focal length."""


@dataclass(frozen=True, eq=False, slots=True)
class DepthImages:
    """Depth of one multi-view along +z of the rectified reference view."""

    depth_m: NDArray[np.float32]
    """(H, W), NaN where there is no answer."""
    sigma_m: NDArray[np.float32]
    """(H, W) 1 sigma, NaN where there is no answer."""
    label: NDArray[np.uint8]
    """(H, W)."""
    points: NDArray[np.float32] | None = None
    """(N, 4) x, y, z and sigma of the known points, m, in the frame of the rectified reference
    view; None where no cloud is wanted. In colour (N, 5): the bytes of the last are blue, green,
    red and 255."""
