"""Sigma and label of every pixel."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.line import MISFIT_LIMIT, UNSEEN, LineFits
from rig.epipolar.rank import highest, lowest, mean
from rig.epipolar.views import Label, SlopeMap

_FILL_REACH_PX = 32
"""How far a surface may be continued over pixels that have no texture of their own."""

_CONTRADICTION = 0.55 * MISFIT_LIMIT
_SPOT_RADIUS_PX, _REGION_RADIUS_PX, _REGION_SHARE = 2, 15, 0.3
_START_ERROR, _HOLD_RADIUS_PX = 0.2, 3
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
    blind_px = range_px / np.sqrt(12.0)
    kept_px = np.float32(_START_ERROR * step_px) * _held_back(lines)
    side_px = _other_side(slope_px, step_px)
    total = np.maximum(misfit, np.float32(1)) * variance + kept_px**2 + side_px**2
    sigma = np.minimum(np.sqrt(total), blind_px).astype(np.float32)
    evident = sigma < 0.25 * blind_px
    sigma[_contradicted(lines.misfit)] = blind_px
    away = cv2.distanceTransform((~evident).astype(np.uint8), cv2.DIST_L2, 3)
    if not evident.any():
        away[:] = np.inf
    none = (away > _FILL_REACH_PX) | (lines.sight == UNSEEN)
    label = np.where(slope_px > 0, Label.NEARER, Label.BEYOND).astype(np.uint8)
    label[hidden] = Label.OCCLUSION
    label[none] = Label.NONE
    slope = np.where(none, np.float32(np.nan), slope_px).astype(np.float32)
    sigma[none] = np.nan
    return SlopeMap(slope, sigma, label, warnings)


def _held_back(lines: LineFits) -> NDArray[np.float32]:
    """Share of the start's error that one step leaves, (H, W).

    Grey noise makes lines look steeper than they are, so that each step is too short.
    """
    signal, all_of_it = (mean(m, _HOLD_RADIUS_PX) for m in (lines.signal, lines.information))
    share = np.clip(signal / np.maximum(all_of_it, np.float32(1e-12)), 0, 1)
    return (1 - share).astype(np.float32)


def _other_side(slope_px: NDArray[np.float32], step_px: float) -> NDArray[np.float32]:
    """Error of a pixel near a jump that may belong to the surface on its other side, (H, W).

    Bounded by what a hypothesis for the next frame may open: it ranks such pixels behind all
    others, and says too little where the pixel really lies on the other side.
    """
    jump = highest(slope_px, _SIDE_RADIUS_PX) - lowest(slope_px, _SIDE_RADIUS_PX)
    error = np.minimum(_SIDE_SHARE * jump, np.float32(_SIDE_LABELS * step_px))
    return np.where(jump > 1.5 * step_px, error, np.float32(0))


def _contradicted(misfit: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels whose views do not agree with their slope, (H, W).

    Where a good share of a region, or of the whole picture, is contradicted, the rest of it agrees
    by chance.
    """
    spot = mean(misfit, _SPOT_RADIUS_PX) > _CONTRADICTION
    if spot.mean() > _REGION_SHARE:
        return np.ones_like(spot)
    region = mean(spot.astype(np.float32), _REGION_RADIUS_PX) > _REGION_SHARE
    return spot | region
