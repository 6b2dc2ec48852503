"""On which side of a slope jump a pixel lies, decided again at full resolution.

At an occlusion the two half-profiles of a line see different surfaces, and a window that joins
pixels fattens the nearer one. Here every pixel near a jump compares two slopes, that of the nearer
and that of the farther surface around it, each by its own line only. Visibility makes the
difference between them: what is really nearer is hidden nowhere, so that every view must agree with
it; the farther surface may be hidden in one half of an axis (Kang, Szeliski and Chai, "Handling
occlusions in dense multi-view stereo", CVPR 2001). Neighbours of like grey value share their
evidence.
"""

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.drift_fit import drift_of_all
from rig.epipolar.rank import highest, lowest
from rig.epipolar.sampling import sample_points
from rig.epipolar.scales import Scales
from rig.epipolar.search.halves import HALVES, assign_halves
from rig.epipolar.search.window import Cameras

_RADIUS_PX = 3
_JUMP_LABELS = 3.0
_LIMIT, _CLEARLY = 3.0, 0.5
"""Grey difference that counts as a full mismatch, and mean difference that decides, in Cauchy
scales of the line fit."""
_UNSEEN = np.float32(1e6)
_FEW = 8
"""One in so many pixels: up to there it costs less to look around each of them by itself."""

_REACH = np.arange(-_RADIUS_PX, _RADIUS_PX + 1, dtype=np.float32)
_NEARNESS = np.float32(1) / (np.float32(1) + _REACH[:, None] ** 2 + _REACH**2)
"""Weight of each neighbour."""


def choose_sides(
    splines: NDArray[np.float32],
    grey: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    movable: NDArray[np.bool_],
    cameras: Cameras,
    scales: Scales,
    drift: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Move pixels near jumps to the side that their own lines clearly prefer, (H, W).

    Args:
        splines: what `rig.epipolar.sampling.pad` makes of the equalised views.
        grey: (H, W) reference view.
        slope_px: (H, W) slope so far, px per view step.
        movable: (H, W) pixels that may change sides.
        cameras: where the views stand.
        scales: grey scales of the images.
        drift: (2, H, W) light that changes with the view, see `rig.epipolar.drift`; None for none.
    """
    rows, columns, low, high = _near_jumps(slope_px, movable, _JUMP_LABELS * cameras.step_px)
    limit = np.float32(_LIMIT * scales.doubt)
    half = assign_halves(cameras.x_steps, cameras.y_steps)
    x_steps, y_steps = cameras.x_steps.astype(np.float32), cameras.y_steps.astype(np.float32)
    sides = np.empty((2, len(rows)), np.float32)
    preference = np.zeros(slope_px.shape, np.float32)
    result, light = slope_px.copy(), drift_of_all(drift)

    def weigh(start: int, stop: int) -> None:
        part = slice(start, stop)
        _find_sides(slope_px, low[part], high[part], rows[part], columns[part], sides[:, part])
        _prefer(
            splines, grey, x_steps, y_steps, half, rows[part], columns[part], sides[:, part], limit,
            light, preference,
        )  # fmt: skip

    def settle(start: int, stop: int) -> None:
        part = slice(start, stop)
        _settle(
            preference, grey, rows[part], columns[part], sides[:, part],
            np.float32(0.5 / scales.likeness), np.float32(_CLEARLY * scales.doubt), result,
        )  # fmt: skip

    run_in_bands(weigh, len(rows))
    run_in_bands(settle, len(rows))
    return result


def _near_jumps(
    slope_px: NDArray[np.float32], movable: NDArray[np.bool_], jump_px: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
    """Rows and columns of the pixels that may move and lie near a jump, and the slopes around.

    Where few may move, as in a frame that is followed, only their surroundings are looked at.
    """
    rows, columns = np.divmod(np.flatnonzero(movable), slope_px.shape[1])
    if len(rows) > movable.size // _FEW:
        low, high = (extreme(slope_px, _RADIUS_PX)[rows, columns] for extreme in (lowest, highest))
    else:
        low, high = np.empty((2, len(rows)), np.float32)
        run_in_bands(
            lambda start, stop: _bound(slope_px, rows, columns, start, stop, low, high), len(rows)
        )
    near = high - low > np.float32(jump_px)
    return rows[near], columns[near], low[near], high[near]


@kernel()
def _bound(
    slope: NDArray[np.float32],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    start: int,
    stop: int,
    low: NDArray[np.float32],
    high: NDArray[np.float32],
) -> None:
    """Fill in the lowest and the highest slope around each of some pixels."""
    height, width = slope.shape
    for i in range(start, stop):
        v, u = rows[i], columns[i]
        least = most = slope[v, u]
        for y in range(max(v - _RADIUS_PX, 0), min(v + _RADIUS_PX + 1, height)):
            for x in range(max(u - _RADIUS_PX, 0), min(u + _RADIUS_PX + 1, width)):
                least, most = min(least, slope[y, x]), max(most, slope[y, x])
        low[i], high[i] = least, most


@kernel()
def _find_sides(
    slope: NDArray[np.float32],
    low: NDArray[np.float32],
    high: NDArray[np.float32],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    sides: NDArray[np.float32],
) -> None:
    """Mean slope of the farther and of the nearer neighbours, near ones first."""
    height, width = slope.shape
    for i in range(len(rows)):
        v, u = rows[i], columns[i]
        middle = np.float32(0.5) * (low[i] + high[i])
        far = far_weight = near = near_weight = np.float32(0)
        for y in range(max(v - _RADIUS_PX, 0), min(v + _RADIUS_PX + 1, height)):
            for x in range(max(u - _RADIUS_PX, 0), min(u + _RADIUS_PX + 1, width)):
                w = _NEARNESS[y - v + _RADIUS_PX, x - u + _RADIUS_PX]
                m = slope[y, x]
                far_w = w if m < middle else np.float32(0)
                far += far_w * m
                far_weight += far_w
                near += (w - far_w) * m
                near_weight += w - far_w
        sides[0, i] = far / far_weight
        sides[1, i] = near / near_weight


@kernel()
def _prefer(
    padded: NDArray[np.float32],
    grey: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    sides: NDArray[np.float32],
    limit: np.float32,
    drift: NDArray[np.float32],
    preference: NDArray[np.float32],
) -> None:
    """Fill in by how much the nearer slope fits worse than the farther one, grey levels."""
    height, width = grey.shape
    count = len(rows)
    here, across, slope, value, tilt, seen = (
        np.empty(count, np.float32),
        np.empty(count, np.float32),
        np.empty(count, np.float32),
        np.empty(count, np.float32),
        np.empty(count, np.float32),
        np.empty(count, np.float32),
    )
    poor = np.zeros((2, HALVES, count), np.float32)
    members = np.zeros((2, HALVES, count), np.float32)
    for side in range(2):
        for i in range(count):
            here[i], across[i] = np.float32(rows[i]), np.float32(columns[i])
            slope[i] = sides[side, i]
        for k in range(len(half)):
            h = half[k]
            if h >= 0:
                sample_points(
                    padded[k], height, width, across, here, slope, x_steps[k], y_steps[k], value,
                    tilt, seen,
                )  # fmt: skip
                for i in range(count):
                    v, u = rows[i], columns[i]
                    lit = grey[v, u]
                    if drift.shape[1] > 0:
                        lit += x_steps[k] * drift[0, v, u] + y_steps[k] * drift[1, v, u]
                    d = min(abs(value[i] - lit), limit)
                    poor[side, h, i] += seen[i] * d
                    members[side, h, i] += seen[i]
    for i in range(count):
        far = _better_halves(poor[0], members[0], i)
        near = seen_by = np.float32(0)
        for h in range(HALVES):
            near += poor[1, h, i]
            seen_by += members[1, h, i]
        known = (far < _UNSEEN) & (seen_by > 0)
        preference[rows[i], columns[i]] = near / seen_by - far if known else np.float32(0)


@kernel()
def _better_halves(poor: NDArray[np.float32], members: NDArray[np.float32], i: int) -> np.float32:
    """Mean over the axes of the better half's mean difference; `_UNSEEN` if no view counts."""
    total = axes = np.float32(0)
    for axis in range(2):
        best = _UNSEEN
        for h in range(2 * axis, 2 * axis + 2):
            if members[h, i] > 0:
                best = min(best, poor[h, i] / members[h, i])
        if best < _UNSEEN:
            total += best
            axes += np.float32(1)
    return total / axes if axes > 0 else _UNSEEN


@kernel()
def _settle(
    preference: NDArray[np.float32],
    grey: NDArray[np.float32],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    sides: NDArray[np.float32],
    per_grey: np.float32,
    clearly: np.float32,
    slope: NDArray[np.float32],
) -> None:
    """Change sides where a pixel and its like neighbours together say so."""
    height, width = grey.shape
    one = np.float32(1)
    for i in range(len(rows)):
        v, u = rows[i], columns[i]
        total = weight = np.float32(0)
        for y in range(max(v - 1, 0), min(v + 2, height)):
            for x in range(max(u - 1, 0), min(u + 2, width)):
                d = (grey[y, x] - grey[v, u]) * per_grey
                w = one / (one + d * d)
                total += w * w * preference[y, x]
                weight += w * w
        far, near, m = sides[0, i], sides[1, i], slope[v, u]
        is_near = m - far > near - m
        if is_near and total > clearly * weight:
            slope[v, u] = far
        elif not is_near and total < -clearly * weight:
            slope[v, u] = near
