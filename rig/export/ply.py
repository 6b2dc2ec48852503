"""PLY point clouds of depth maps: binary, little-endian, in the reference camera's frame, mm.

Each vertex has x, y, z, its 1-sigma of depth and, where they are known, its label and colour;
pixels without an answer have no vertex. Format: G. Turk, "The PLY polygon file format", Stanford,
1994.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from rig.depth import read_pfm
from rig.errors import FormatError
from rig.export.cloud import Cloud, cloud_of
from rig.export.exported import ExportedDepth
from rig.export.frame_export import FrameExport
from rig.files import write_bytes
from rig.geometry.rectification import rectify
from rig.live.captured import CapturedFrame
from rig.stored import stored_rig

if TYPE_CHECKING:
    from rig.database import Store

_TYPES = {"<f4": "float", "|u1": "uchar"}
_COLOURS = ("red", "green", "blue")


def write_ply(path: Path, cloud: Cloud) -> int:
    """Write all points that are known; return how many.

    Raises:
        StoreError: the file cannot be written.
    """
    known = cloud.known
    vertex = np.dtype(
        [
            *((name, "<f4") for name in ("x", "y", "z", "sigma_mm")),
            *([] if cloud.label is None else [("label", "u1")]),
            *([] if cloud.rgb is None else [(name, "u1") for name in _COLOURS]),
        ]
    )
    vertices = np.empty(int(known.sum()), vertex)
    points_mm = cloud.points_mm[known]
    for axis, name in enumerate("xyz"):
        vertices[name] = points_mm[:, axis]
    vertices["sigma_mm"] = cloud.sigma_mm[known]
    if cloud.label is not None:
        vertices["label"] = cloud.label[known]
    if cloud.rgb is not None:
        for channel, name in enumerate(_COLOURS):
            vertices[name] = cloud.rgb[known][:, channel]
    header = "\n".join(
        (
            "ply",
            "format binary_little_endian 1.0",
            *(f"comment {comment}" for comment in cloud.comments),
            f"element vertex {len(vertices)}",
            *(f"property {_TYPES[vertex[name].str]} {name}" for name in vertex.names or ()),
            "end_header",
            "",
        )
    )
    write_bytes(path, header.encode() + vertices.tobytes())
    return len(vertices)


@dataclass(frozen=True, slots=True)
class PlyExport:
    """Writes the points of one depth map by a stored calibration."""

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
        cloud = Cloud(camera.points_mm(depth_mm), sigma_mm)
        if not cloud.known.any():
            raise FormatError(
                f"{path}: the depth map has no answer at any pixel", advice="nothing to write"
            )
        return ExportedDepth(path, write_ply(path, cloud))


class CapturePly(FrameExport):
    """Writes `points_NNNNN.ply` of the frames of a capture, in colour or grey by its pictures."""

    __slots__ = ()
    format: ClassVar[str] = "ply"

    def write(self, frame: CapturedFrame, folder: Path) -> int:
        """See `FrameExport.write`."""
        return write_ply(folder / f"points_{frame.index:05d}.ply", cloud_of(frame))
