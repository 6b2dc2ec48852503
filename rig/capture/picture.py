"""One picture that shows a person what was shown."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.depth import write_bytes
from rig.live.frame import DepthFrame

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_STRIP_PX = 34
_BAR_PX = 200
_BAR_ROWS = slice(10, 24)
_GAP_PX = 8
_FONT_SCALE = 0.48
_REFERENCE = "reference view"


def write_picture(path: Path, shown: DepthFrame, reference: int) -> Path:
    """Write the reference image beside its depth (or slope) in colour, with a scale below.

    Near is warm and far is cool; grey has no answer. Pictures that are narrower than the scale have
    white beside them.

    Raises:
        StoreError: the file cannot be written.
    """
    frame, image = shown.views.frames[reference], shown.image
    if image.dtype != np.uint8:
        image = cv2.convertScaleAbs(image, alpha=255.0 / frame.full_scale)
    if shown.colour is None:
        left = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    else:
        left = cv2.cvtColor(shown.colour, cv2.COLOR_RGB2BGR)
    if shown.depth is None:
        values, unit, near_is_large = shown.slopes.slope_px, "px per view step", True
    else:
        values, unit, near_is_large = shown.depth.depth_mm, "mm", False
    right, low, high = _in_colour(np.asarray(values, np.float64), near_is_large=near_is_large)
    scale = _scale(low, high, unit, near_is_large=near_is_large)
    scale_x_px = max(left.shape[1], _width_px(_REFERENCE) + _GAP_PX) + _GAP_PX
    width_px = max(left.shape[1] + right.shape[1], scale_x_px + scale.shape[1])
    whole = np.full((left.shape[0] + _STRIP_PX, width_px, 3), 255, np.uint8)
    whole[: left.shape[0], : left.shape[1] + right.shape[1]] = np.hstack([left, right])
    _write(whole[left.shape[0] :], _GAP_PX, _REFERENCE)
    whole[left.shape[0] :, scale_x_px : scale_x_px + scale.shape[1]] = scale
    _, encoded = cv2.imencode(".png", whole)
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


def _scale(low: float, high: float, unit: str, *, near_is_large: bool) -> NDArray[np.uint8]:
    """Return the colours from the lowest value to the highest, with both: (H, W, 3)."""
    ramp = np.linspace(0.0, 255.0, _BAR_PX).astype(np.uint8)
    ramp = ramp if near_is_large else ramp[::-1]
    bar = cv2.applyColorMap(
        np.tile(ramp, (_BAR_ROWS.stop - _BAR_ROWS.start, 1)), cv2.COLORMAP_TURBO
    )
    digits = 0 if high - low > 50.0 else 2
    first, last = f"{low:.{digits}f}", f"{high:.{digits}f} {unit}"
    start_px = _width_px(first) + _GAP_PX
    end_px = start_px + _BAR_PX + _GAP_PX
    strip = np.full((_STRIP_PX, end_px + _width_px(last) + _GAP_PX, 3), 255, np.uint8)
    _write(strip, 0, first)
    strip[_BAR_ROWS, start_px : start_px + _BAR_PX] = bar
    _write(strip, end_px, last)
    return strip


def _width_px(text: str) -> int:
    return cv2.getTextSize(text, _FONT, _FONT_SCALE, 1)[0][0]


def _write(strip: NDArray[np.uint8], x_px: int, text: str) -> None:
    cv2.putText(strip, text, (x_px, 22), _FONT, _FONT_SCALE, (40, 40, 40), 1, cv2.LINE_AA)
