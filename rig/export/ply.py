"""PLY point cloud of one depth map: binary, little-endian, in the reference camera's frame, mm.

Each vertex has x, y, z and its 1-sigma of depth; pixels without an answer have no vertex. Format:
G. Turk, "The PLY polygon file format", Stanford, 1994.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rig.depth import read_pfm
from rig.errors import FormatError
from rig.export.exported import ExportedDepth
from rig.files import write_bytes
from rig.geometry.rectification import rectify
from rig.stored import stored_rig

if TYPE_CHECKING:
    from rig.database import Store

_VERTEX = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("sigma_mm", "<f4")])


def write_ply(path: Path, points_mm: NDArray[np.float64], sigma_mm: NDArray[np.float32]) -> int:
    """Write all points that are known; return how many.

    Args:
        path: where.
        points_mm: (..., 3).
        sigma_mm: (...) 1 sigma of the depth.

    Raises:
        FormatError: no point is known.
        StoreError: the file cannot be written.
    """
    known = np.isfinite(points_mm).all(axis=-1)
    count = int(known.sum())
    if count == 0:
        raise FormatError(
            f"{path}: the depth map has no answer at any pixel", advice="nothing to write"
        )
    vertices = np.empty(count, _VERTEX)
    for axis, name in enumerate("xyz"):
        vertices[name] = points_mm[known][:, axis]
    vertices["sigma_mm"] = sigma_mm[known]
    header = "\n".join(
        (
            "ply",
            "format binary_little_endian 1.0",
            "comment x right, y down, z forward from the reference camera, mm",
            f"element vertex {count}",
            *(f"property float {name}" for name in _VERTEX.names or ()),
            "end_header",
            "",
        )
    )
    write_bytes(path, header.encode() + vertices.tobytes())
    return count


@dataclass(frozen=True, slots=True)
class PlyExport:
    """Writes the points of one depth map."""

    capture: Path
    """Folder of `rig capture`."""
    frame: int = 0
    """Which of its multi-views."""

    def export(self, store: "Store", number: int, out: Path | None) -> ExportedDepth:
        """See `Exporter.export`; the calibration is the one that the capture was made with."""
        rig = stored_rig(store, number)
        path = out or Path(f"depth_{self.frame:05d}.ply")
        depth_mm = read_pfm(self.capture / f"depth_{self.frame:05d}.pfm")
        sigma_mm = read_pfm(self.capture / f"sigma_{self.frame:05d}.pfm")
        camera = rectify(rig.geometry, rig.profile.pitch_mm).pinhole
        return ExportedDepth(path, write_ply(path, camera.points_mm(depth_mm), sigma_mm))
