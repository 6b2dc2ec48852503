"""What to show next, and when more pictures would not help."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.calibrate.conclude import pose_text
from rig.calibrate.coverage import Coverage
from rig.geometry.bundle import Calibration
from rig.geometry.bundle.direction_error import direction_error_of

FEWEST_PICTURES = 12
"""Pictures before the first solve."""
SOLVE_EVERY = 6
"""New pictures between two solves."""

_FEWEST_SHARED = 6
_TILT_DEG = 15.0
_DISTANCE_RATIO = 1.4
_AREA_SHARE = 0.75
_LITTLE_GAIN = 0.1
"""Relative fall of the depth error between two solves, and by the best next pose, in which more
pictures are not worth their time."""
JUDGED_AT = 1
"""Which of the headline's distances is watched: 1 m."""


@dataclass(frozen=True, slots=True)
class Advice:
    """What the operator reads next."""

    text: str
    covered: bool
    """Whether views, tilts, distances and area are covered; then only the solver knows better."""


def advise(coverage: Coverage, names: Sequence[str], reference: int) -> Advice:
    """Say what is missing most."""
    missing = (
        _pair(coverage, names, reference)
        or _tilt(coverage)
        or _distance(coverage)
        or _area(coverage, names)
    )
    return Advice(missing or "good coverage: go on with other places and tilts", missing is None)


def coverage_text(coverage: Coverage, names: Sequence[str]) -> str:
    """Return what the pictures cover so far, in one line."""
    area = ", ".join(f"{n} {a:.0%}" for n, a in zip(names, coverage.area_share, strict=True))
    pairs = [
        f"{names[i]}-{names[j]} {coverage.shared[i, j]}"
        for i in range(len(names))
        for j in range(i + 1, len(names))
    ]
    words = f"area {area}" + (f"; pairs {', '.join(pairs)}" if pairs else "")
    if not len(coverage.distances_mm):
        return words
    low, high = coverage.tilts_deg.min(axis=0), coverage.tilts_deg.max(axis=0)
    return (
        f"{words}; tilt about x {low[0]:+.0f}..{high[0]:+.0f}, about y "
        f"{low[1]:+.0f}..{high[1]:+.0f} deg; distance "
        f"{coverage.distances_mm.min():.0f}..{coverage.distances_mm.max():.0f} mm"
    )


def next_pose(calibration: Calibration) -> str | None:
    """Return the pose that would shrink the depth error most, in words."""
    poses = calibration.verdict.poses
    return pose_text(poses[0]) if poses else None


def enough(solves: Sequence[Calibration]) -> bool:
    """Whether the latest solves say that more pictures would not help much."""
    if len(solves) < 2 or not solves[-1].verdict.good:
        return False
    before, now = map(_judged_error, solves[-2:])
    fell = 1.0 - now / before if before > 0 else 0.0
    return bool(np.isfinite(now)) and fell < _LITTLE_GAIN


def _judged_error(calibration: Calibration) -> float:
    """What pictures make smaller: depth error in per cent, of one camera that of directions, px."""
    if calibration.depth_error:
        return calibration.depth_error[JUDGED_AT].picture_pct
    return direction_error_of(calibration).picture_px


def _pair(coverage: Coverage, names: Sequence[str], reference: int) -> str | None:
    shared = coverage.shared[reference].copy()
    shared[reference] = np.iinfo(np.intp).max
    worst = int(shared.argmin())
    if shared[worst] >= _FEWEST_SHARED:
        return None
    return (
        f"show the target where {names[reference]} and {names[worst]} both see it "
        f"({shared[worst]} pictures so far)"
    )


def _tilt(coverage: Coverage) -> str | None:
    if not len(coverage.tilts_deg):
        return None
    low, high = coverage.tilts_deg.min(axis=0), coverage.tilts_deg.max(axis=0)
    for reached, way in (
        (high[1], "turn its left side, as the camera sees it, away from the camera"),
        (-low[1], "turn its right side, as the camera sees it, away from the camera"),
        (high[0], "tilt its lower side away from the camera"),
        (-low[0], "tilt its upper side away from the camera"),
    ):
        if reached < _TILT_DEG:
            return f"{way} by about 30 deg"
    return None


def _distance(coverage: Coverage) -> str | None:
    distances_mm = coverage.distances_mm
    if not len(distances_mm) or distances_mm.max() > _DISTANCE_RATIO * distances_mm.min():
        return None
    wanted_mm = distances_mm.max() / 1.8
    return f"bring it nearer, to about {wanted_mm:.0f} mm"


def _area(coverage: Coverage, names: Sequence[str]) -> str | None:
    worst = int(coverage.area_share.argmin())
    if coverage.area_share[worst] >= _AREA_SHARE:
        return None
    empty = np.argwhere(coverage.cells[worst] == 0)
    rows, columns = coverage.cells.shape[1:]
    middle = np.array([(rows - 1) / 2, (columns - 1) / 2])
    row, column = empty[int(np.abs(empty - middle).sum(axis=1).argmax())]
    height = "top" if row < middle[0] else "bottom"
    side = "left" if column < middle[1] else "right" if column > middle[1] else "middle"
    return (
        f"show it in the {height} {side} of the picture of {names[worst]} "
        f"({coverage.area_share[worst]:.0%} of its area so far)"
    )
