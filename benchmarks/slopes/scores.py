"""Error measures of a slope map against exact (or reference) slopes."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.scenes import WIDE_RANGE_PX

_EDGE_BAND_RADIUS_PX = 2
_WORST_PX = 4.0


@dataclass(frozen=True)
class Scores:
    """Shares in per cent; pixels without an answer count as bad."""

    bad_001: float
    bad_003: float
    bad_007: float
    bad_1: float
    mse_100: float
    edge_bad: float
    density: float
    confident_bad_007: float
    sigma_ratio: float


def score(
    slope_px: NDArray[np.floating],
    sigma_px: NDArray[np.floating] | None,
    true_px: NDArray[np.floating],
    range_px: tuple[float, float],
    border_px: int,
) -> Scores:
    """Compare; `edge_bad` counts errors above 0.07 (1 for wide ranges) near true slope jumps."""
    inner = (slice(border_px, -border_px or None),) * 2
    error = (slope_px - true_px)[inner]
    size = np.where(np.isfinite(error), np.abs(error), np.inf)
    wide = range_px[1] - range_px[0] > WIDE_RANGE_PX
    edge = _near_edges(true_px, 0.02 * (range_px[1] - range_px[0]))[inner]

    def bad(limit: float, where: NDArray[np.bool_] | slice = slice(None)) -> float:
        return 100.0 * float((size[where] > limit).mean())

    ratio, confident = np.nan, np.nan
    if sigma_px is not None:
        sigma = sigma_px[inner]
        ratio = float(1.4826 * np.nanmedian(np.abs(error / sigma)))
        confident = bad(0.07, sigma <= np.nanquantile(sigma, 0.8))
    return Scores(
        bad(0.01),
        bad(0.03),
        bad(0.07),
        bad(1.0),
        100.0 * float((np.minimum(size, _WORST_PX) ** 2).mean()),
        bad(1.0 if wide else 0.07, edge),
        100.0 * float(np.isfinite(error).mean()),
        confident,
        ratio,
    )


def _near_edges(true_px: NDArray[np.floating], jump_px: float) -> NDArray[np.bool_]:
    """A band of five pixels around jumps of the true slope."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    jumps = cv2.morphologyEx(true_px.astype(np.float32), cv2.MORPH_GRADIENT, cross) > jump_px
    size = 2 * _EDGE_BAND_RADIUS_PX - 1
    return cv2.dilate(jumps.astype(np.uint8), np.ones((size, size), np.uint8)).astype(bool)
