"""A sheet as PNG, with its resolution written into the file."""

import struct
import zlib

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.errors import OptionError
from rig.targets.printing.drawing import Area, Disc, Drawing, Line, Rect

_MM_PER_INCH = 25.4
_MOST_PX = 30_000
_IHDR_END = 33
"""Signature (8) and the first chunk (4 + 4 + 13 + 4), behind which pHYs may stand."""
_LETTER_PX = 21.0
"""Height of OpenCV's plain letters at scale 1."""


def png_of(drawing: Drawing, dots_per_in: float) -> bytes:
    """Return the file. Pixels that an edge crosses hold the ink that covers them, exactly.

    Raises:
        ConfigError: the picture would be too large, or have no pixels.
    """
    px_per_mm = dots_per_in / _MM_PER_INCH
    width_px = round(drawing.width_mm * px_per_mm)
    height_px = round(drawing.height_mm * px_per_mm)
    if not (1 <= width_px <= _MOST_PX and 1 <= height_px <= _MOST_PX):
        raise OptionError(
            f"--dpi {dots_per_in:g} asked for: {width_px} x {height_px} px",
            advice=f"at most {_MOST_PX} px a side are drawn",
        )
    sheet = np.ones((height_px, width_px), np.float32)
    for area in drawing.areas:
        _paint(sheet, area, px_per_mm)
    picture = np.rint(sheet * 255).astype(np.uint8)
    for line in drawing.lines:
        _write(picture, line, px_per_mm)
    done, encoded = cv2.imencode(".png", picture)
    if not done:
        raise OptionError(
            f"a picture of {width_px} x {height_px} px could not be turned to PNG",
            advice="draw it smaller, or take .svg",
        )
    data = encoded.tobytes()
    return data[:_IHDR_END] + _resolution(dots_per_in) + data[_IHDR_END:]


def _paint(sheet: NDArray[np.float32], area: Area, px_per_mm: float) -> None:
    """Lay ink over the sheet by the share of every pixel that the shapes cover together."""
    cover = np.zeros_like(sheet)
    for rect in area.rects:
        window, share = _covered(rect, px_per_mm, (sheet.shape[0], sheet.shape[1]))
        cover[window] += share
    for disc in area.discs:
        window, share = _covered_by_disc(disc, px_per_mm, (sheet.shape[0], sheet.shape[1]))
        cover[window] += share
    level = 0.0 if area.ink == "black" else 1.0
    sheet += np.minimum(cover, 1.0) * (level - sheet)


def _covered(
    rect: Rect, px_per_mm: float, shape: tuple[int, int]
) -> tuple[tuple[slice, slice], NDArray[np.float32]]:
    down = _run(rect.y_mm * px_per_mm, (rect.y_mm + rect.height_mm) * px_per_mm, shape[0])
    across = _run(rect.x_mm * px_per_mm, (rect.x_mm + rect.width_mm) * px_per_mm, shape[1])
    return (down[0], across[0]), np.outer(down[1], across[1]).astype(np.float32)


def _covered_by_disc(
    disc: Disc, px_per_mm: float, shape: tuple[int, int]
) -> tuple[tuple[slice, slice], NDArray[np.float32]]:
    """As of a straight edge through each pixel: a hundredth of one off, at most, at usual sizes."""
    x, y, radius = disc.x_mm * px_per_mm, disc.y_mm * px_per_mm, disc.radius_mm * px_per_mm
    down, _ = _run(y - radius - 1, y + radius + 1, shape[0])
    across, _ = _run(x - radius - 1, x + radius + 1, shape[1])
    rows = np.arange(down.start, down.stop) + 0.5 - y
    columns = np.arange(across.start, across.stop) + 0.5 - x
    share = np.clip(radius + 0.5 - np.hypot(columns, rows[:, None]), 0.0, 1.0)
    return (down, across), share.astype(np.float32)


def _run(low: float, high: float, count: int) -> tuple[slice, NDArray[np.float64]]:
    """Pixels that an interval touches, and how much of each it covers."""
    first, last = max(int(np.floor(low)), 0), min(int(np.ceil(high)), count)
    edges = np.arange(first, last + 1, dtype=np.float64)
    return slice(first, last), np.diff(np.clip(edges, low, high))


def _write(picture: NDArray[np.uint8], line: Line, px_per_mm: float) -> None:
    scale = line.height_mm * 0.7 * px_per_mm / _LETTER_PX
    place = (round(line.x_mm * px_per_mm), round(line.y_mm * px_per_mm))
    thick = max(1, round(scale * 1.5))
    cv2.putText(
        picture, line.text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, (0,), thick, cv2.LINE_AA
    )


def _resolution(dots_per_in: float) -> bytes:
    """The chunk pHYs (ISO 15948): pixels per metre, both ways."""
    per_metre = round(dots_per_in / _MM_PER_INCH * 1000)
    body = b"pHYs" + struct.pack(">IIB", per_metre, per_metre, 1)
    return struct.pack(">I", 9) + body + struct.pack(">I", zlib.crc32(body))
