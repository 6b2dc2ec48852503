"""Depth as robots want it: along +z of the rectified reference view, in m."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.compute.kernel import kernel
from rig.frames import ColourImage
from rig.geometry.pinhole import Pinhole
from rig.recording import DepthImages

MOST_MM: Final = 65535
_M_PER_MM: Final = np.float32(1e-3)


class DepthForRobots:
    """Turns depth maps of one camera into those of robots.

    Args:
        pinhole: that the maps are seen by; None where it is unknown, and then maps are of a rig
            without a calibration, whose pictures are not rectified: both depths are the same.
        points: whether clouds are wanted; there are none without a pinhole.
    """

    def __init__(self, pinhole: Pinhole | None, *, points: bool) -> None:
        self._m_per_mm: NDArray[np.float32] | np.float32 = _M_PER_MM
        self._rays: NDArray[np.float32] | None = None
        if pinhole is None:
            return
        y, x = np.indices((pinhole.height_px, pinhole.width_px), dtype=np.float64)
        x_px, y_px = pinhole.principal_point_px
        ones = np.ones_like(x)
        rays = np.stack([(x - x_px) / pinhole.focal_px, (y - y_px) / pinhole.focal_px, ones], -1)
        forward = rays @ pinhole.common_from_reference[:, 2]
        if not np.array_equal(forward, ones):
            self._m_per_mm = (1e-3 / forward).astype(np.float32)
        if points:
            self._rays = np.ascontiguousarray(rays[..., :2].reshape(-1, 2).T, np.float32)

    def of(
        self,
        depth_mm: NDArray[np.float32],
        sigma_mm: NDArray[np.float32],
        label: NDArray[np.uint8],
        colour: ColourImage | None = None,
    ) -> DepthImages:
        """Return maps (H, W), and the cloud where one is wanted, in colour where there is some."""
        depth_m, sigma_m = depth_mm * self._m_per_mm, sigma_mm * self._m_per_mm
        points = None if self._rays is None else _cloud(self._rays, depth_m, sigma_m, colour)
        return DepthImages(depth_m, sigma_m, label, points)


def _cloud(
    rays: NDArray[np.float32],
    depth_m: NDArray[np.float32],
    sigma_m: NDArray[np.float32],
    colour: ColourImage | None,
) -> NDArray[np.float32]:
    """See `DepthImages.points`, of the known pixels; rays (2, H * W) are x / z and y / z."""
    z_m = depth_m.ravel()
    points = np.empty((len(z_m), 4 if colour is None else 5), np.float32)
    np.multiply(rays[0], z_m, out=points[:, 0])
    np.multiply(rays[1], z_m, out=points[:, 1])
    points[:, 2] = z_m
    points[:, 3] = sigma_m.ravel()
    if colour is not None:
        packed = points.view(np.uint8).reshape(len(z_m), 20)[:, 16:]
        packed[:, :3] = colour.reshape(-1, 3)[:, ::-1]
        packed[:, 3] = 255
    return np.compress(np.isfinite(z_m), points, axis=0)


def whole_mm(depth_m: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Return depth (H, W) in whole mm, 0 for no answer and for what 16 bits cannot hold.

    Programs that read such pictures know no other mark; the depth in m beside it has all.
    """
    whole = np.empty(depth_m.shape, np.uint16)
    _round(np.ascontiguousarray(depth_m).reshape(-1), whole.reshape(-1))
    return whole


@kernel()
def _round(depth_m: NDArray[np.float32], whole: NDArray[np.uint16]) -> None:
    """Fill in whole mm, in one pass: five of numpy's cost a tenth of a recorded frame."""
    for i in range(len(whole)):
        rounded = np.rint(depth_m[i] * np.float32(1000))
        held = (rounded >= np.float32(1)) & (rounded <= np.float32(MOST_MM))  # False for NaN
        whole[i] = np.uint16(np.int32(rounded if held else np.float32(0)))
