"""TIFF of 32-bit floats, one map per file, NaN for no answer: what GIS and image programs open.

Baseline TIFF with the IEEE sample format (Adobe, TIFF revision 6.0, 1992, sections 8 and 19): one
strip, not compressed, little-endian. The description of each holds unit and times as JSON.
"""

import json
import struct
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rig.export.frame_export import FrameExport, times_of
from rig.files import write_bytes
from rig.live.captured import VIRTUAL_DEPTH, CapturedFrame

_ASCII, _SHORT, _LONG = 2, 3, 4
_HEADER_BYTES, _ENTRY_BYTES = 8, 12
_VIRTUAL_UNIT = "distances from lenslets to sensor"
_DEPTH_FROM = "along +z of the reference camera, from its optical centre"


class TiffExport(FrameExport):
    """Writes `depth_NNNNN.tiff` and `sigma_NNNNN.tiff`, mm; slopes where there is no depth.

    Of a lenslet camera also `virtual_depth_NNNNN.tiff`.
    """

    __slots__ = ()
    format: ClassVar[str] = "tiff"

    def write(self, frame: CapturedFrame, folder: Path) -> None:
        """See `FrameExport.write`."""
        if frame.has_depth:
            maps, unit = {"depth": frame.depth_mm, "sigma": frame.sigma_mm}, "mm"
        else:
            maps, unit = {"slope": frame.slope_px, "sigma": frame.sigma_px}, "px per view step"
        maps = {kind: (values, unit) for kind, values in maps.items()}
        virtual = frame.virtual_depth
        if virtual is not None:
            maps[VIRTUAL_DEPTH] = virtual, _VIRTUAL_UNIT
        for kind, (values, unit) in maps.items():
            told = {"map": kind, "unit": unit, **times_of(frame)}
            if kind == "depth":
                told["from"] = _DEPTH_FROM
            content = tiff_of(values, json.dumps(told))
            write_bytes(folder / f"{kind}_{frame.index:05d}.tiff", content)


def tiff_of(values: NDArray[np.float32], description: str) -> bytes:
    """Return a map (H, W) as the content of a TIFF file; the description is ASCII."""
    height, width = values.shape
    rows = np.ascontiguousarray(values, "<f4").tobytes()
    said = description.encode("ascii") + b"\0"
    gap = b"\0" * (len(said) % 2)  # what follows begins at an even place
    count = 11
    directory_bytes = 2 + count * _ENTRY_BYTES + 4
    said_at = _HEADER_BYTES + directory_bytes
    rows_at = said_at + len(said) + len(gap)
    entries = (
        (256, _LONG, 1, width),
        (257, _LONG, 1, height),
        (258, _SHORT, 1, 32),  # bits of a sample
        (259, _SHORT, 1, 1),  # not compressed
        (262, _SHORT, 1, 1),  # small is dark
        (270, _ASCII, len(said), said_at),
        (273, _LONG, 1, rows_at),
        (277, _SHORT, 1, 1),  # samples per pixel
        (278, _LONG, 1, height),  # all rows in one strip
        (279, _LONG, 1, len(rows)),
        (339, _SHORT, 1, 3),  # IEEE floating point
    )
    directory = struct.pack("<H", count)
    directory += b"".join(struct.pack("<HHLL", *entry) for entry in entries)
    return struct.pack("<2sHL", b"II", 42, _HEADER_BYTES) + directory + bytes(4) + said + gap + rows
