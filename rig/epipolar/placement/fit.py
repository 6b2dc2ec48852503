"""Errors of the places that views are told to have, from the match itself.

Once the slopes are known, what is left between the views tells how far each picture lies from where
its position puts it: by a part that all pixels share (a picture shifted against its lines) and one
in proportion to their slopes (a camera off its place). Slopes and grey values of the pixels are
unknowns of the same least squares and eliminated pixel by pixel, as points are in a bundle
adjustment (B. Triggs, P. McLauchlan, R. Hartley and A. Fitzgibbon, "Bundle adjustment - a modern
synthesis", 1999).

Two things no match can know: shifts in proportion to the positions (they are one slope more for all
pixels) and positions that are all too large by one factor (slopes too small by it); of views on one
line, also what turns that line. Where most views are misplaced, the mean of the slopes stays what
the positions told; where few are, the others tell it. What remains unknown is expected to be as
large as the errors that are seen, and becomes a part of the sigma of slopes
(`Placement.slope_sigma_px`).
"""

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.epipolar.median import near_jumps
from rig.epipolar.placement.equations import UNKNOWNS, Lines
from rig.epipolar.placement.placement import Placement
from rig.epipolar.placement.solve import expect_alike, fit_places, slope_variance
from rig.epipolar.sampling import pad, sample_points
from rig.epipolar.search.window import Cameras

_PIXELS, _SMALLEST_CELL_PX, _BORDER_PX = 2000, 8, 4
_FEWEST_PIXELS, _FEWEST_VIEWS, _MOST_VIEWS = 150, 3, 32
"""In larger arrays errors of single places average out, and the fit grows with the third power."""
_JUMP_LABELS, _JUMP_RADIUS_PX = 1.5, 4
_CELLS = 6
"""Cells along the longer side of the picture, over which what is left unexplained is shared."""
_NOTICEABLE_PX, _SURE, _BETTER = 0.03, 4.0, 2.0
_SEEN = 3.0
"""Where no place is off by so many of its sigmas, what no match can know is not off either."""
"""Errors of sampling amount to one or two hundredths of a pixel; how many of its own sigmas the
error of a place must have, of which gloss and shade that the whole picture shares make up to
three; and how many of its own the fall of the misfit in the other half."""
_HALF_PX = np.float32(0.5)


def find_placement(
    images: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    covered: NDArray[np.bool_],
    cameras: Cameras,
    noise_levels: float,
    splines: NDArray[np.float32] | None = None,
    drift: NDArray[np.float32] | None = None,
) -> Placement | None:
    """Tell where the views are.

    Args:
        images: (V, H, W) equalised grey values.
        slope_px: (H, W) slopes.
        covered: (V, H, W) pixels that a view does not show.
        cameras: where the views are told to be.
        noise_levels: white noise of the grey values, 1 sigma.
        splines: what `rig.epipolar.sampling.pad` makes of the images, if there already.
        drift: (2, H, W) light that changes with the view, see `rig.epipolar.drift`; None for none.

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
    if splines is None:
        splines = pad(images, cameras.x_steps, cameras.y_steps)
    lines = _lines(splines, slope_px, rows, columns, cameras, drift)
    fit = fit_places(lines, cameras.x_steps, cameras.y_steps, cameras.reference, noise_levels)
    distance_px, sigma_px = _distances(fit.found, fit.covariance, lines.slope_px)
    is_misplaced = distance_px > np.maximum(_NOTICEABLE_PX, _SURE * sigma_px)
    is_misplaced &= fit.gain > _BETTER
    is_seen = bool((distance_px > np.maximum(_NOTICEABLE_PX, _SEEN * sigma_px)).any())
    largest_px = float(np.abs(lines.slope_px).max())
    found, covariance = expect_alike(fit, is_misplaced, cameras.reference, largest_px)
    taken_out = np.where(is_misplaced[:, None], found, 0.0)
    borne = (found - taken_out).ravel()
    tilt = lines.tilts(cameras.x_steps, cameras.y_steps)
    return Placement(
        taken_out[:, :2].copy(),
        taken_out[:, 2:].copy(),
        distance_px,
        sigma_px,
        is_misplaced,
        slope_variance(lines, tilt, covariance + np.outer(borne, borne)) * is_seen,
    )


def _steepest(
    grey: NDArray[np.float32], clear: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the steepest clear pixel of every small square, (N,)."""
    steep = np.gradient(grey, axis=1) ** 2 + np.gradient(grey, axis=0) ** 2
    inner = np.where(clear, steep, np.float32(0))[_BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX]
    cell = max(_SMALLEST_CELL_PX, round((inner.size / _PIXELS) ** 0.5))
    height, width = inner.shape[0] // cell, inner.shape[1] // cell
    if height == 0 or width == 0:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    cells = inner[: height * cell, : width * cell].reshape(height, cell, width, cell)
    cells = cells.swapaxes(1, 2).reshape(height, width, -1)
    best = cells.argmax(axis=2)
    used = cells.max(axis=2) > 0
    rows, columns = np.indices((height, width)) * cell + _BORDER_PX
    return (rows + best // cell)[used], (columns + best % cell)[used]


def _lines(
    splines: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    cameras: Cameras,
    drift: NDArray[np.float32] | None,
) -> Lines:
    """Sample the lines of N pixels, cell by cell: first the black ones of a chess-board."""
    side = max(slope_px.shape) / _CELLS
    down, right = (rows / side).astype(int), (columns / side).astype(int)
    is_white = (down + right) % 2
    order = np.lexsort((columns, right, down, is_white))
    cell = (_CELLS * down + right)[order]
    rows, columns = rows[order], columns[order]
    slope = slope_px[rows, columns].astype(np.float64)
    sampled = _sample(splines, slope_px.shape, rows, columns, slope, cameras)
    difference, across, down_slope, seen = sampled
    if drift is not None:
        along_row, along_column = drift[:, rows, columns, None]
        difference -= along_row * cameras.x_steps + along_column * cameras.y_steps
    half = int((is_white == 0).sum())
    starts = np.flatnonzero(np.diff(cell, prepend=-1))
    return Lines(difference, seen, across, down_slope, slope, half, starts)


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


def _distances(found: Float, covariance: Float, slope_px: Float) -> tuple[Float, Float]:
    """How far the pictures lie from their places at the slopes that there are, and sigma, (V,)."""
    views = len(found)
    mean, square = float(slope_px.mean()), float((slope_px**2).mean())
    moments = np.kron(np.array([[1.0, -mean], [-mean, square]]), np.eye(2))
    blocks = covariance.reshape(views, UNKNOWNS, views, UNKNOWNS)
    own = np.stack([blocks[i, :, i] for i in range(views)])
    distance = np.einsum("vi,ij,vj->v", found, moments, found)
    variance = np.einsum("vij,ji->v", own, moments)
    return np.sqrt(np.maximum(distance, 0.0)), np.sqrt(np.maximum(variance, 0.0))
