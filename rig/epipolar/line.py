"""One Gauss-Newton step of the epipolar line through every pixel.

Along the line of a reference pixel all views show one unknown grey value, so the slope and that
value are fitted together: a mean-centred least-squares problem with Cauchy weights (Holland and
Welsch, "Robust regression using iteratively reweighted least-squares", 1977). Views are sampled
with Catmull-Rom splines (Catmull and Rom, 1974). A half that does not see the point is left out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.kernel import kernel
from rig.epipolar.sweep import HALVES, assign_halves

SEEN, HALF_HIDDEN, UNSEEN = 0, 1, 2
"""All halves see the point; one half of an axis does not; it falls outside all other views."""


@dataclass(frozen=True, slots=True)
class LineFits:
    """The optimum of every pixel's own epipolar line."""

    slope_px: NDArray[np.float32]
    """(H, W)."""
    information: NDArray[np.float32]
    """(H, W) weighted sum of squared mean-centred grey slopes, (grey / (px per step))^2."""
    residual: NDArray[np.float32]
    """(H, W) weighted sum of squared grey residuals over all views."""
    weight: NDArray[np.float32]
    """(H, W) sum of the weights of all views, the reference's own 1 included."""
    sight: NDArray[np.uint8]
    """(H, W) `SEEN`, `HALF_HIDDEN` or `UNSEEN`."""


def fit_lines(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    reference: int,
    slope_px: NDArray[np.float32],
    scale: float,
    reach_px: float,
) -> LineFits:
    """Improve every pixel's slope by one step.

    Args:
        images: (V, H, W) equalised grey values.
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        reference: index of the reference view.
        slope_px: (H, W) start, px per view step.
        scale: grey difference beyond which a view is doubted (Cauchy scale).
        reach_px: largest step that the linearisation can be trusted for, px per view step.
    """
    height, width = slope_px.shape
    half = assign_halves(x_steps, y_steps)
    slope = np.empty((height, width), np.float32)
    information, residual, weight = (np.empty((height, width), np.float32) for _ in range(3))
    sight = np.empty((height, width), np.uint8)

    def work(start: int, stop: int) -> None:
        _fit_lines(
            images, x_steps.astype(np.float32), y_steps.astype(np.float32), half, reference,
            slope_px, np.float32(scale), np.float32(reach_px), start, stop,
            slope, information, residual, weight, sight,
        )  # fmt: skip

    run_in_bands(work, height)
    return LineFits(slope, information, residual, weight, sight)


@kernel()
def _fit_lines(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    reference: int,
    start_slope: NDArray[np.float32],
    scale: np.float32,
    reach: np.float32,
    start: int,
    stop: int,
    slope: NDArray[np.float32],
    information: NDArray[np.float32],
    residual: NDArray[np.float32],
    weight: NDArray[np.float32],
    sight: NDArray[np.uint8],
) -> None:
    views, _, width = images.shape
    grey = np.empty(views, np.float32)
    tilt = np.empty(views, np.float32)
    seen = np.empty(views, np.bool_)
    per_scale = np.float32(1) / scale
    for v in range(start, stop):
        for u in range(width):
            m = start_slope[v, u]
            centre = images[reference, v, u]
            for i in range(views):
                seen[i], value, by_x, by_y = _sample(
                    images[i], np.float32(u - m * x_steps[i]), np.float32(v - m * y_steps[i]),
                    y_steps[i] == 0, x_steps[i] == 0,
                )  # fmt: skip
                grey[i] = value - centre
                tilt[i] = -(x_steps[i] * by_x + y_steps[i] * by_y)
            sight[v, u] = _leave_out_hidden(grey, half, per_scale, seen)
            move, information[v, u], residual[v, u], weight[v, u] = _step(
                grey, tilt, seen, per_scale, reach
            )
            slope[v, u] = m + move


@kernel()
def _leave_out_hidden(
    grey: NDArray[np.float32],
    half: NDArray[np.int32],
    per_scale: np.float32,
    seen: NDArray[np.bool_],
) -> np.uint8:
    """Unmark the half of an axis that fits much worse than the other; return the sight."""
    misfit = np.zeros(HALVES, np.float32)
    members = np.zeros(HALVES, np.float32)
    for i in range(len(grey)):
        if seen[i] and half[i] >= 0:
            misfit[half[i]] += min(abs(grey[i]) * per_scale, np.float32(3))
            members[half[i]] += np.float32(1)
    sight = UNSEEN if members.sum() == 0 else SEEN
    for h in range(HALVES):
        other = h ^ 1
        if members[h] > 0 and members[other] > 0:
            mine, theirs = misfit[h] / members[h], misfit[other] / members[other]
            if mine > np.float32(1) and mine > np.float32(2.5) * theirs:
                sight = HALF_HIDDEN
                for i in range(len(grey)):
                    if half[i] == h:
                        seen[i] = False
    return np.uint8(sight)


@kernel()
def _step(
    grey: NDArray[np.float32],
    tilt: NDArray[np.float32],
    seen: NDArray[np.bool_],
    per_scale: np.float32,
    reach: np.float32,
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Step of the slope, its information, what remains of the squares, and the sum of weights."""
    sw = swj = swg = swjj = swjg = swgg = np.float32(0)
    for i in range(len(grey)):
        if seen[i]:
            g, j = grey[i], tilt[i]
            t = g * per_scale
            w = np.float32(1) / (np.float32(1) + t * t)
            sw += w
            swj += w * j
            swg += w * g
            swjj += w * j * j
            swjg += w * j * g
            swgg += w * g * g
    information = swjj - swj * swj / sw
    cross = swjg - swj * swg / sw
    move = np.float32(0)
    if information > np.float32(1e-12):
        move = max(min(-cross / information, reach), -reach)
    else:
        information = np.float32(0)
    rest = swgg - swg * swg / sw + np.float32(2) * move * cross + move * move * information
    return move, information, max(rest, np.float32(0)), sw


def sample_view(
    image: NDArray[np.float32], x_step: float, y_step: float, slope_px: NDArray[np.float32]
) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Where one view shows every reference pixel: whether inside (H, W) and grey value (H, W)."""
    seen = np.zeros(slope_px.shape, np.bool_)
    grey = np.zeros(slope_px.shape, np.float32)
    _sample_view(image, np.float32(x_step), np.float32(y_step), slope_px, seen, grey)
    return seen, grey


@kernel()
def _sample_view(
    image: NDArray[np.float32],
    x_step: np.float32,
    y_step: np.float32,
    slope: NDArray[np.float32],
    seen: NDArray[np.bool_],
    grey: NDArray[np.float32],
) -> None:
    height, width = slope.shape
    for v in range(height):
        for u in range(width):
            m = slope[v, u]
            seen[v, u], grey[v, u], _, _ = _sample(
                image, np.float32(u - m * x_step), np.float32(v - m * y_step), y_step == 0,
                x_step == 0,
            )  # fmt: skip


@kernel()
def _sample(
    image: NDArray[np.float32], x: np.float32, y: np.float32, on_row: bool, on_column: bool
) -> tuple[bool, np.float32, np.float32, np.float32]:
    """Grey value and its two derivatives at (x, y), and whether that lies inside the image."""
    height, width = image.shape
    zero = np.float32(0)
    ix, iy = int(np.floor(x)), int(np.floor(y))
    if not (0 <= x <= width - 1 and 0 <= y <= height - 1):
        return False, zero, zero, zero
    fx, fy = np.float32(x - ix), np.float32(y - iy)
    if on_row:
        value, slope = _catmull_rom(
            image[iy, max(ix - 1, 0)], image[iy, ix], image[iy, min(ix + 1, width - 1)],
            image[iy, min(ix + 2, width - 1)], fx,
        )  # fmt: skip
        return True, value, slope, zero
    if on_column:
        value, slope = _catmull_rom(
            image[max(iy - 1, 0), ix], image[iy, ix], image[min(iy + 1, height - 1), ix],
            image[min(iy + 2, height - 1), ix], fy,
        )  # fmt: skip
        return True, value, zero, slope
    x0, x1, x2, x3 = max(ix - 1, 0), ix, min(ix + 1, width - 1), min(ix + 2, width - 1)
    y0, y1, y2, y3 = max(iy - 1, 0), iy, min(iy + 1, height - 1), min(iy + 2, height - 1)
    v0, d0 = _catmull_rom(image[y0, x0], image[y0, x1], image[y0, x2], image[y0, x3], fx)
    v1, d1 = _catmull_rom(image[y1, x0], image[y1, x1], image[y1, x2], image[y1, x3], fx)
    v2, d2 = _catmull_rom(image[y2, x0], image[y2, x1], image[y2, x2], image[y2, x3], fx)
    v3, d3 = _catmull_rom(image[y3, x0], image[y3, x1], image[y3, x2], image[y3, x3], fx)
    value, by_y = _catmull_rom(v0, v1, v2, v3, fy)
    by_x, _ = _catmull_rom(d0, d1, d2, d3, fy)
    return True, value, by_x, by_y


@kernel()
def _catmull_rom(
    a: np.float32, b: np.float32, c: np.float32, d: np.float32, t: np.float32
) -> tuple[np.float32, np.float32]:
    """Value and derivative at t between b (t = 0) and c (t = 1)."""
    half = np.float32(0.5)
    k1 = half * (c - a)
    k2 = a - np.float32(2.5) * b + np.float32(2) * c - half * d
    k3 = half * (d - a) + np.float32(1.5) * (b - c)
    value = b + t * (k1 + t * (k2 + t * k3))
    slope = k1 + t * (np.float32(2) * k2 + np.float32(3) * t * k3)
    return value, slope
