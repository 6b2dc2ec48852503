"""Wires, leaves and the gaps between them: missed, swollen, filled."""

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.hard_scenes import WALL_PX
from benchmarks.slopes.honesty import measure_honesty
from benchmarks.slopes.scenes import Scene
from rig.epipolar import Label, SlopeMap

_REACH_PX = 20
"""Edges do not swell farther than this."""
_GAP_WINDOW_PX, _GAP_SHARE = 31, 0.25
"""A gap is wall of which a quarter of the surroundings is covered."""
_BLIND_SHARE = 0.25


def wires(found: SlopeMap, scene: Scene) -> str:
    """Wire pixels nearer to the wall's slope, confidently so, and by how much wires swell."""
    middle_px = 0.5 * float(scene.slope_px.min() + scene.slope_px.max())
    wire = scene.slope_px > middle_px
    sighted = found.label != Label.NONE
    with np.errstate(invalid="ignore"):
        missed = wire & sighted & (found.slope_px < middle_px)
        taken = sighted & (found.slope_px > middle_px)
    h = measure_honesty(found, np.where(missed, scene.slope_px, np.nan), scene.range_px)
    count = int(wire.sum())
    sure = 0.0 if not missed.any() else h.wrong * float(missed.sum()) / count
    swollen = np.concatenate([_runs(taken, wire, side) for side in (-1, 1)])
    return (
        f"missed {100 * missed.sum() / count:.1f}, confidently {sure:.1f}, blind "
        f"{100 * (wire & ~sighted).sum() / count:.1f}, swollen {np.median(swollen):.0f} px median, "
        f"{swollen.mean():.1f} mean"
    )


def _runs(taken: NDArray[np.bool_], wire: NDArray[np.bool_], side: int) -> NDArray[np.float64]:
    """How many pixels beside each edge, in one direction of the row, are taken for wire."""
    taken, wire = taken[:, ::side], wire[:, ::side]
    rows, columns = np.nonzero(wire[:, :-1] & ~wire[:, 1:])
    inside = columns + _REACH_PX < wire.shape[1]
    rows, columns = rows[inside], columns[inside]
    beside = np.stack([taken[rows, columns + k] for k in range(1, _REACH_PX + 1)], axis=1)
    return np.cumprod(beside, axis=1).sum(axis=1).astype(np.float64)


def gaps(found: SlopeMap, scene: Scene) -> str:
    """Wall seen through gaps: right within 1 px or blind, and the same with the unsure."""
    wall = np.abs(scene.slope_px - WALL_PX) < 0.5
    size = (_GAP_WINDOW_PX,) * 2
    covered = cv2.boxFilter((~wall).astype(np.float32), -1, size)
    gap = wall & (covered >= _GAP_SHARE)
    width_px = scene.range_px[1] - scene.range_px[0]
    blind = found.label == Label.NONE
    with np.errstate(invalid="ignore"):
        right = np.abs(found.slope_px - scene.slope_px) <= 1.0
        unsure = found.sigma_px > _BLIND_SHARE * width_px / np.sqrt(12.0)
    fine, thin = right | blind, ~wall
    return (
        f"gaps {100 * gap.mean():.1f}: right or blind {100 * fine[gap].mean():.1f}, or unsure "
        f"{100 * (fine | unsure)[gap].mean():.1f}, blind {100 * blind[gap].mean():.1f}; "
        f"in front: right or blind {100 * fine[thin].mean():.1f}"
    )
