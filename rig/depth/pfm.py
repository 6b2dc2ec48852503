"""Portable float maps: the master format of slopes and depths.

A text line each for `Pf`, width and height, and a scale whose sign tells the byte order (negative
is little-endian), then rows of float32 from the bottom up (Debevec's format, see
https://www.pauldebevec.com/Research/HDR/PFM/). NaN, no answer, is kept. The magnitude of the scale
has no agreed meaning: 1 is written, and none is applied.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.errors import StoreError
from rig.files import read_bytes, write_bytes

_HEADER = re.compile(
    rb"(P[fF])\s+(\d{1,9})\s+(\d{1,9})\s+([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s"
)
"""One white-space character, not more, ends it: the next byte may be data that looks like one."""


def write_pfm(path: Path, values: NDArray[np.float32]) -> None:
    """Write a map.

    Args:
        path: Where; an older file of this name is replaced.
        values: (H, W) float32, top row first, not empty.

    Raises:
        StoreError: another shape or type, or the file cannot be written.
    """
    if values.ndim != 2 or values.size == 0 or values.dtype != np.float32:
        raise StoreError(
            f"{path}: asked to write an array {values.shape} of {values.dtype}",
            advice="a grey PFM holds (H, W) of float32",
        )
    height, width = values.shape
    rows = np.ascontiguousarray(values[::-1], "<f4")
    write_bytes(path, f"Pf\n{width} {height}\n-1.0\n".encode() + rows.tobytes())


def read_pfm(path: Path) -> NDArray[np.float32]:
    """Read a grey map: (H, W) float32, top row first.

    Raises:
        StoreError: the file cannot be read, or is no whole grey PFM.
    """
    content = read_bytes(path)
    header = _HEADER.match(content)
    if header is None:
        raise StoreError(
            f"{path}: found {content[:24]!r}, expected a PFM header (Pf, width, height, scale)",
            advice="give a PFM file",
        )
    kind, width, height, scale = header.groups()
    rows, columns = int(height), int(width)
    if kind == b"PF":
        raise StoreError(
            f"{path}: a colour PFM (PF) of three channels", advice="give a grey one (Pf)"
        )
    if rows * columns == 0 or not 0 < abs(float(scale)) < np.inf:
        raise StoreError(
            f"{path}: width {columns}, height {rows}, scale {scale[:40].decode()}",
            advice="none may be 0",
        )
    data = content[header.end() :]
    if len(data) != 4 * rows * columns:
        raise StoreError(
            f"{path}: {columns} x {rows} px need {4 * rows * columns} bytes, found {len(data)}",
            advice="the file is cut off or not a PFM: write it again",
        )
    order = "<f4" if float(scale) < 0 else ">f4"
    values = np.frombuffer(data, order).reshape(rows, columns)
    return np.ascontiguousarray(values[::-1], np.float32)
