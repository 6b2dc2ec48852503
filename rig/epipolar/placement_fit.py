"""Errors of the places that views are told to have, from the match itself.

Once the slopes are known, what is left between the views tells how far each picture lies from where
its position puts it: by a part that all pixels share (a picture shifted against its lines) and one
in proportion to their slopes (a camera off its place). Slopes and grey values of the pixels are
unknowns of the same least squares and eliminated pixel by pixel, as points are in a bundle
adjustment (B. Triggs, P. McLauchlan, R. Hartley and A. Fitzgibbon, "Bundle adjustment - a modern
synthesis", 1999).

Two things no match can know: shifts in proportion to the positions (they are one slope more for all
pixels) and positions that are all too large by one factor (slopes too small by it). Both are held
at zero, so that the mean of the slopes stays what the positions told.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands, run_side_by_side
from rig.epipolar.median import near_jumps
from rig.epipolar.placement import Placement
from rig.epipolar.sampling import pad, sample_points
from rig.epipolar.window import Cameras

Float = NDArray[np.float64]

_PIXELS, _SMALLEST_CELL_PX, _BORDER_PX = 2000, 8, 4
_FEWEST_PIXELS, _FEWEST_VIEWS, _MOST_VIEWS = 150, 3, 32
"""In larger arrays errors of single places average out, and the fit grows with the third power."""
_JUMP_LABELS, _JUMP_RADIUS_PX = 1.5, 4
_DOUBT_SIGMAS, _ROUNDS = 3.0, 2
_EXPECTED_PX, _HELD = 0.3, 1e8
"""Error of a place that is believed without evidence, 1 sigma; and how many times stronger than
that what cannot be known is held."""
_HALF_PX = np.float32(0.5)
_PIXELS_AT_ONCE = 32
_UNKNOWNS = 4
"""Of a view: shift right and down, px; position right and down, view steps."""


def find_placement(
    images: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    covered: NDArray[np.bool_],
    cameras: Cameras,
    noise_levels: float,
    splines: NDArray[np.float32] | None = None,
) -> Placement | None:
    """Tell where the views are.

    Args:
        images: (V, H, W) equalised grey values.
        slope_px: (H, W) slopes.
        covered: (V, H, W) pixels that a view does not show.
        cameras: where the views are told to be.
        noise_levels: white noise of the grey values, 1 sigma.
        splines: what `rig.epipolar.sampling.pad` makes of the images, if there already.

    Returns:
        None where there are too few views (its slope explains any shift of a pair), more than pay,
        or too few pixels.
    """
    if not _FEWEST_VIEWS <= len(images) <= _MOST_VIEWS:
        return None
    clear = ~near_jumps(slope_px, _JUMP_LABELS * cameras.step_px, _JUMP_RADIUS_PX)
    rows, columns = _steepest(
        images[cameras.reference], clear & ~np.logical_or.reduce(covered, axis=0)
    )
    if len(rows) < _FEWEST_PIXELS:
        return None
    slope = slope_px[rows, columns].astype(np.float64)
    if splines is None:
        splines = pad(images, cameras.x_steps, cameras.y_steps)
    difference, across, down, seen = _sample(splines, slope_px.shape, rows, columns, slope, cameras)
    design = -np.stack([across, down, -slope * across, -slope * down], axis=1)
    tilt = -(across[:, None] * cameras.x_steps + down[:, None] * cameras.y_steps)
    prior = _prior(cameras, float(np.abs(slope).max()))
    # A grey value and a slope of each pixel take up two of its differences.
    free = np.maximum(seen.sum(axis=1) - 2, 0).sum() / max(int(seen.sum()), 1)
    weight = seen.astype(np.float64)
    found, covariance = np.zeros((len(images), _UNKNOWNS)), np.zeros_like(prior)
    for _ in range(_ROUNDS):
        normal, right = _in_halves(_normal_equations, weight, design, tilt, difference)
        covariance[:] = np.linalg.inv(normal / noise_levels**2 + prior)
        found = (covariance @ (right / noise_levels**2)).reshape(-1, _UNKNOWNS)
        left = _rest(weight, tilt, difference - design @ found.T)
        scatter = 1.4826 * float(np.median(np.abs(left[seen])))
        noise_levels = max(scatter / max(free, 0.1) ** 0.5, 1e-9)
        weight = seen / (1.0 + (left / (_DOUBT_SIGMAS * noise_levels)) ** 2)
    return _placement(found, covariance, slope)


def _in_halves(sums: Callable[..., tuple[Float, Float]], *of_pixels: Float) -> tuple[Float, Float]:
    """Add up what a function sums over pixels, each half of them on a thread of its own."""
    half = len(of_pixels[0]) // 2
    first, last = run_side_by_side(
        lambda: sums(*(one[:half] for one in of_pixels)),
        lambda: sums(*(one[half:] for one in of_pixels)),
    )
    return first[0] + last[0], first[1] + last[1]


def _steepest(
    grey: NDArray[np.float32], clear: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the steepest clear pixel of every small square, (N,)."""
    steep = np.gradient(grey, axis=1) ** 2 + np.gradient(grey, axis=0) ** 2
    inner = np.where(clear, steep, np.float32(0))[_BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX]
    cell = max(_SMALLEST_CELL_PX, round((inner.size / _PIXELS) ** 0.5))
    height, width = inner.shape[0] // cell, inner.shape[1] // cell
    cells = inner[: height * cell, : width * cell].reshape(height, cell, width, cell)
    cells = cells.swapaxes(1, 2).reshape(height, width, -1)
    best = cells.argmax(axis=2)
    used = cells.max(axis=2) > 0
    rows, columns = np.indices((height, width)) * cell + _BORDER_PX
    return (rows + best // cell)[used], (columns + best % cell)[used]


def _sample(
    splines: NDArray[np.float32],
    shape: tuple[int, int],
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    slope_px: Float,
    cameras: Cameras,
) -> tuple[Float, Float, Float, NDArray[np.bool_]]:
    """Grey values along the lines of N pixels.

    Returns:
        Difference of every view to the reference (N, V); mean slope of the grey value right and
        down (N,), of all views, as one of them alone would have noise in common with its
        differences; and which views see the pixel (N, V).
    """
    (height, width), views, count = shape, len(splines), len(rows)
    u, v = columns.astype(np.float32), rows.astype(np.float32)
    places = (
        (u, v), (u + _HALF_PX, v), (u - _HALF_PX, v), (u, v + _HALF_PX), (u, v - _HALF_PX),
    )  # fmt: skip
    grey = np.empty((views, len(places), count), np.float32)
    seen = np.ones((views, count), np.bool_)
    slope = slope_px.astype(np.float32)

    def work(start: int, stop: int) -> None:
        tilt, inside = np.empty(count, np.float32), np.empty(count, np.float32)
        for i in range(start, stop):
            x, y = np.float32(cameras.x_steps[i]), np.float32(cameras.y_steps[i])
            for k, (across, down) in enumerate(places):
                sample_points(
                    splines[i], height, width, across, down, slope, x, y, grey[i, k], tilt, inside
                )
                seen[i] &= inside > 0

    run_in_bands(work, views)
    shares = seen / np.maximum(seen.sum(axis=0), 1)
    difference = (grey[:, 0] - grey[cameras.reference, 0]).T.astype(np.float64)
    across = (shares * (grey[:, 1] - grey[:, 2])).sum(axis=0)
    down = (shares * (grey[:, 3] - grey[:, 4])).sum(axis=0)
    return difference, across, down, np.ascontiguousarray(seen.T)


def _prior(cameras: Cameras, largest_px: float) -> Float:
    """Inverse covariance of the unknowns before anything is seen, (4 V, 4 V)."""
    views = len(cameras.x_steps)
    step = _EXPECTED_PX / max(largest_px, 1e-3)
    scale = np.tile([_EXPECTED_PX, _EXPECTED_PX, step, step], views)
    unknown = np.zeros((2, views, _UNKNOWNS))
    unknown[0, :, 0] = unknown[1, :, 2] = cameras.x_steps
    unknown[0, :, 1] = unknown[1, :, 3] = cameras.y_steps
    held = unknown.reshape(2, -1) / scale
    held /= np.linalg.norm(held, axis=1, keepdims=True)
    prior = np.eye(len(scale)) + _HELD * held.T @ held
    fixed = slice(_UNKNOWNS * cameras.reference, _UNKNOWNS * (cameras.reference + 1))
    prior[fixed, fixed] += _HELD * np.eye(_UNKNOWNS)
    return prior / np.outer(scale, scale)


def _normal_equations(
    weight: Float, design: Float, tilt: Float, difference: Float
) -> tuple[Float, Float]:
    """Normal matrix (4 V, 4 V) and right side (4 V) once slope and grey value are eliminated.

    Args:
        weight: (N, V) of every difference.
        design: (N, 4) what the unknowns of a view do to its difference.
        tilt: (N, V) what a change of the pixel's slope does to it.
        difference: (N, V).
    """
    pixels, views = weight.shape
    count, first, second, det = _moments(weight, tilt)
    wide = (weight[:, :, None] * design[:, None, :]).reshape(pixels, -1)
    tilted = ((weight * tilt)[:, :, None] * design[:, None, :]).reshape(pixels, -1)
    mixed = _summed(wide * (first / det)[:, None], tilted)
    normal = mixed + mixed.T
    normal -= _summed(wide * (second / det)[:, None], wide)
    normal -= _summed(tilted * (count / det)[:, None], tilted)
    own = _summed(weight, (design[:, :, None] * design[:, None, :]).reshape(pixels, -1))
    for i in range(views):
        here = slice(_UNKNOWNS * i, _UNKNOWNS * (i + 1))
        normal[here, here] += own[i].reshape(_UNKNOWNS, _UNKNOWNS)
    return normal, _summed(weight * _rest(weight, tilt, difference), design).ravel()


def _rest(weight: Float, tilt: Float, difference: Float) -> Float:
    """Take from differences (N, V) what a grey value and a slope of each pixel explain."""
    count, first, second, det = _moments(weight, tilt)
    total = (weight * difference).sum(axis=1)
    tilted = (weight * tilt * difference).sum(axis=1)
    grey = (second * total - first * tilted) / det
    slope = (count * tilted - first * total) / det
    return difference - grey[:, None] - slope[:, None] * tilt


def _moments(weight: Float, tilt: Float) -> tuple[Float, Float, Float, Float]:
    """Weighted sums over the views of 1, tilt and tilt^2, and their determinant, (N,) each."""
    count = weight.sum(axis=1) + 1e-9
    first = (weight * tilt).sum(axis=1)
    second = (weight * tilt**2).sum(axis=1) * (1 + 1e-9) + 1e-9
    return count, first, second, count * second - first**2


def _summed(one: Float, other: Float) -> Float:
    """Sum over the pixels of the products of what they have, (N, A) and (N, B): (A, B).

    In small parts, for which the linear algebra library starts no threads: they would wait for
    cores that others use, and add up in an order of their own.
    """
    total = np.zeros((one.shape[1], other.shape[1]))
    for start in range(0, len(one), _PIXELS_AT_ONCE):
        part = slice(start, start + _PIXELS_AT_ONCE)
        total += one[part].T @ other[part]
    return total


def _placement(found: Float, covariance: Float, slope_px: Float) -> Placement:
    """Turn the solution into distances in the pictures, at the slopes that there are."""
    views = len(found)
    mean, square = float(slope_px.mean()), float((slope_px**2).mean())
    moments = np.kron(np.array([[1.0, -mean], [-mean, square]]), np.eye(2))
    blocks = covariance.reshape(views, _UNKNOWNS, views, _UNKNOWNS)
    own = np.stack([blocks[i, :, i] for i in range(views)])
    distance = np.einsum("vi,ij,vj->v", found, moments, found)
    variance = np.einsum("vij,ji->v", own, moments)
    return Placement(
        found[:, :2].copy(), found[:, 2:].copy(),
        np.sqrt(np.maximum(distance, 0.0)), np.sqrt(np.maximum(variance, 0.0)),
    )  # fmt: skip
