"""One picture that shows a person what was measured."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.capture.live import Measured
from rig.depth import write_bytes
from rig.stored import Run

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_STRIP_PX = 34
_BAR_PX = 200


def write_picture(path: Path, measured: Measured, run: Run) -> Path:
    """Write the reference image beside its depth (or slope) in colour, with a scale.

    Near is warm and far is cool; grey has no answer.

    Raises:
        StoreError: the file cannot be written.
    """
    reference = run.profile.reference
    frame = measured.multiview.frames[reference]
    image = run.optics.pictures(measured.multiview.stack())[reference]
    if image.dtype != np.uint8:
        image = cv2.convertScaleAbs(image, alpha=255.0 / frame.full_scale)
    left = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    if measured.depth is None:
        values, unit, near_is_large = measured.slopes.slope_px, "px per view step", True
    else:
        values, unit, near_is_large = measured.depth.depth_mm, "mm", False
    right, low, high = _in_colour(np.asarray(values, np.float64), near_is_large=near_is_large)
    picture = np.hstack([left, right])
    strip = np.full((_STRIP_PX, picture.shape[1], 3), 255, np.uint8)
    _write(strip, 8, "reference view")
    _draw_scale(strip, left.shape[1] + 8, low, high, unit, near_is_large=near_is_large)
    _, encoded = cv2.imencode(".png", np.vstack([picture, strip]))
    write_bytes(path, encoded.tobytes())
    return path


def _in_colour(
    values: NDArray[np.float64], *, near_is_large: bool
) -> tuple[NDArray[np.uint8], float, float]:
    known = np.isfinite(values)
    low, high = (np.percentile(values[known], [1.0, 99.0])) if known.any() else (0.0, 1.0)
    share = (np.nan_to_num(values) - low) / max(high - low, 1e-9)
    warm = share if near_is_large else 1.0 - share
    levels = np.clip(255.0 * warm, 0.0, 255.0).astype(np.uint8)
    colour = np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_TURBO), np.uint8)
    colour[~known] = 128
    return colour, float(low), float(high)


def _draw_scale(
    strip: NDArray[np.uint8], x_px: int, low: float, high: float, unit: str, *, near_is_large: bool
) -> None:
    ramp = np.linspace(0.0, 255.0, _BAR_PX).astype(np.uint8)
    ramp = ramp if near_is_large else ramp[::-1]
    bar = cv2.applyColorMap(np.tile(ramp, (14, 1)), cv2.COLORMAP_TURBO)
    digits = 0 if high - low > 50.0 else 2
    _write(strip, x_px, f"{low:.{digits}f}")
    start = x_px + 64
    strip[10:24, start : start + _BAR_PX] = bar
    _write(strip, start + _BAR_PX + 8, f"{high:.{digits}f} {unit}")


def _write(strip: NDArray[np.uint8], x_px: int, text: str) -> None:
    cv2.putText(strip, text, (x_px, 22), _FONT, 0.48, (40, 40, 40), 1, cv2.LINE_AA)
