"""PCD point clouds of version 0.7, binary: what the Point Cloud Library and its viewers open.

The cloud is organised: a point for every pixel, row by row, with NaN where there is no answer.
Colour is packed as PCL packs it, one 32-bit word of red, green and blue whose type says float.
"""

from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rig.export.cloud import Cloud, cloud_of
from rig.export.frame_export import FrameExport
from rig.files import write_bytes
from rig.live.captured import CapturedFrame

_KINDS = {"f": "F", "u": "U"}


class PcdExport(FrameExport):
    """Writes `points_NNNNN.pcd`."""

    __slots__ = ()
    format: ClassVar[str] = "pcd"

    def write(self, frame: CapturedFrame, folder: Path) -> int:
        """See `FrameExport.write`."""
        cloud = cloud_of(frame)
        write_bytes(folder / f"points_{frame.index:05d}.pcd", pcd_of(cloud))
        return int(cloud.known.sum())


def pcd_of(cloud: Cloud) -> bytes:
    """Return a cloud as the content of a PCD file."""
    fields: dict[str, NDArray[np.generic]] = {
        name: cloud.points_mm[..., axis].astype("<f4") for axis, name in enumerate("xyz")
    }
    if cloud.rgb is not None:
        red, green, blue = np.moveaxis(cloud.rgb.astype("<u4"), -1, 0)
        fields["rgb"] = ((red << 16) | (green << 8) | blue).view("<f4")
    fields["sigma_mm"] = cloud.sigma_mm.astype("<f4")
    if cloud.label is not None:
        fields["label"] = cloud.label
    height, width = cloud.sigma_mm.shape
    points = np.empty(
        (height, width), np.dtype([(name, one.dtype) for name, one in fields.items()])
    )
    for name, values in fields.items():
        points[name] = values
    kinds = [one.dtype for one in fields.values()]
    header = "\n".join(
        (
            "# .PCD v0.7 - Point Cloud Data file format",
            *(f"# {comment}" for comment in cloud.comments),
            "VERSION 0.7",
            f"FIELDS {' '.join(fields)}",
            f"SIZE {' '.join(str(kind.itemsize) for kind in kinds)}",
            f"TYPE {' '.join(_KINDS[kind.kind] for kind in kinds)}",
            f"COUNT {' '.join('1' for _ in kinds)}",
            f"WIDTH {width}",
            f"HEIGHT {height}",
            "VIEWPOINT 0 0 0 1 0 0 0",
            f"POINTS {width * height}",
            "DATA binary",
            "",
        )
    )
    return header.encode("ascii") + points.tobytes()
