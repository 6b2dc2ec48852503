"""Sigma and label of every pixel."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands, run_side_by_side
from rig.epipolar.line import MISFIT_LIMIT, UNSEEN, LineFits
from rig.epipolar.rank import highest, lowest, mean
from rig.epipolar.views import Label, SlopeMap

_FILL_REACH_PX = 32
"""How far a surface may be continued over pixels that have no texture of their own."""

_CONTRADICTION = 0.55 * MISFIT_LIMIT
_SPOT_RADIUS_PX, _REGION_RADIUS_PX, _REGION_SHARE = 2, 15, 0.3
_START_ERROR, _HOLD_RADIUS_PX = 0.15, 3
"""Error of the slope before the line fit, in labels, 1 sigma."""
_SIDE_RADIUS_PX, _SIDE_SHARE, _SIDE_LABELS = 2, np.float32(0.3), 0.7
"""About a tenth of the pixels so close to a jump lie on the wrong side: root of 0.1 of the jump."""


def judge(
    slope_px: NDArray[np.float32],
    variance: NDArray[np.float32],
    misfit: NDArray[np.float32],
    lines: LineFits,
    hidden: NDArray[np.bool_],
    step_px: float,
    range_px: float,
    warnings: tuple[str, ...],
) -> SlopeMap:
    """Turn the stitched fit into sigma and labels.

    The variance of the stitched plane rests on the grey noise around every pixel, or on the scatter
    of the neighbours' lines where that is larger.

    Where the views contradict the slope (a wrong hypothesis, a hidden or mirroring surface), sigma
    is that of a blind guess: as the next frame's hypothesis it opens the search again.

    A pixel whose neighbourhood cannot tell the slope within the searched range keeps the slope of
    its surroundings with the sigma of a blind guess, unless the nearest evidence is over
    `_FILL_REACH_PX` away: then it has no answer.
    """
    start_px, blind_px = np.float32(_START_ERROR * step_px), np.float32(range_px / 12**0.5)
    kept, side_px, contradicted = run_side_by_side(
        lambda: _held_back(lines),
        lambda: _other_side(slope_px, step_px),
        lambda: _contradicted(lines.misfit),
    )
    sigma, unclear = np.empty_like(slope_px), np.empty(slope_px.shape, np.bool_)

    def weigh(start: int, stop: int) -> None:
        r = slice(start, stop)
        total = np.maximum(misfit[r], np.float32(1)) * variance[r]
        total += (start_px * kept[r]) ** 2 + side_px[r] ** 2
        np.minimum(np.sqrt(total), blind_px, out=sigma[r])
        np.greater_equal(sigma[r], np.float32(0.25) * blind_px, out=unclear[r])
        np.copyto(sigma[r], blind_px, where=contradicted[r])

    run_in_bands(weigh, len(sigma))
    away = cv2.distanceTransform(unclear.view(np.uint8), cv2.DIST_L2, 3)
    if unclear.all():
        away[:] = np.inf
    slope, label = slope_px.copy(), np.empty(slope_px.shape, np.uint8)

    def tell(start: int, stop: int) -> None:
        r = slice(start, stop)
        none = (away[r] > _FILL_REACH_PX) | (lines.sight[r] == UNSEEN)
        label[r] = np.where(slope[r] > 0, np.uint8(Label.NEARER), np.uint8(Label.BEYOND))
        label[r][hidden[r]] = Label.OCCLUSION
        for values, instead in ((label, Label.NONE), (slope, np.nan), (sigma, np.nan)):
            values[r][none] = instead

    run_in_bands(tell, len(label))
    return SlopeMap(slope, sigma, label, warnings)


def _held_back(lines: LineFits) -> NDArray[np.float32]:
    """Share of the start's error that one step leaves, (H, W).

    Grey noise makes lines look steeper than they are, so that each step is too short.
    """
    signal, all_of_it = (mean(m, _HOLD_RADIUS_PX) for m in (lines.signal, lines.information))
    share = signal / np.maximum(all_of_it, np.float32(1e-12))
    return np.float32(1) - np.minimum(np.maximum(share, np.float32(0)), np.float32(1))


def _other_side(slope_px: NDArray[np.float32], step_px: float) -> NDArray[np.float32]:
    """Error of a pixel near a jump that may belong to the surface on its other side, (H, W).

    Bounded by what a hypothesis for the next frame may open: it ranks such pixels behind all
    others, and says too little where the pixel really lies on the other side.
    """
    jump = highest(slope_px, _SIDE_RADIUS_PX) - lowest(slope_px, _SIDE_RADIUS_PX)
    error = np.minimum(_SIDE_SHARE * jump, np.float32(_SIDE_LABELS * step_px))
    return np.where(jump > np.float32(1.5 * step_px), error, np.float32(0))


def _contradicted(misfit: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels whose views do not agree with their slope, (H, W).

    Where a good share of a region, or of the whole picture, is contradicted, the rest of it agrees
    by chance.
    """
    spot = mean(misfit, _SPOT_RADIUS_PX) > np.float32(_CONTRADICTION)
    if np.count_nonzero(spot) > _REGION_SHARE * spot.size:
        return np.ones_like(spot)
    region = mean(spot.astype(np.float32), _REGION_RADIUS_PX) > _REGION_SHARE
    return spot | region
