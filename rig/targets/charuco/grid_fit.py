"""Corners of a ChArUco board fitted where its grid has them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.charuco.board import CharucoBoard
from rig.targets.charuco.cells import flat_grid, padded_grid
from rig.targets.corner_fit import fit_crossings
from rig.targets.crossing import Markers
from rig.targets.outliers import inliers
from rig.targets.pyramid import Picture, at_level, from_level

_LEAST_CONTRAST = 0.35
"""Of the median: a crossing fitted with less is not of the board."""
_MOST_MOVED = 0.1
"""Way from where a corner is expected to where it is fitted, in sides of a square."""
_MOST_SIGMAS = 6.0
"""Sigma of a corner, in medians: fitted to something else."""


@dataclass(frozen=True, slots=True)
class GridFits:
    """What was fitted at the places of a grid, corner or not; NaN where nothing was."""

    xy_px: Float
    """(rows, columns, 2), px of the level fitted in, as all below."""
    sigma_px: Float
    """(rows, columns)."""
    blur_px: Float
    contrast: Float
    moved: Float
    """From where it was expected, in sides of a square."""

    @property
    def tried(self) -> NDArray[np.bool_]:
        """(rows, columns) where a corner was looked for."""
        return np.isfinite(self.blur_px)

    @property
    def good(self) -> NDArray[np.bool_]:
        """(rows, columns) corners of the board: in place, as strong and sharp, colours in turn."""
        # No residual at all: a flat piece of a picture, which any crossing without contrast fits.
        usable = np.isfinite(self.sigma_px) & (self.sigma_px > 0)
        if not usable.any():
            return usable
        row, column = np.indices(usable.shape)
        signed = np.where((row + column) % 2 == 0, self.contrast, -self.contrast)
        usual = float(np.median(signed[usable]))
        usable &= signed * np.sign(usual) > _LEAST_CONTRAST * abs(usual)
        usable &= self.moved < _MOST_MOVED
        if usable.any():
            usable &= self.sigma_px < _MOST_SIGMAS * np.median(self.sigma_px[usable])
        return usable


@dataclass(frozen=True, slots=True)
class CornerGrid:
    """Corners on the board's grid, NaN where there is none."""

    xy_px: Float
    """(rows, columns, 2)."""
    sigma_px: Float
    """(rows, columns)."""
    blur_px: float
    contrast: float
    fits: GridFits

    @property
    def found(self) -> NDArray[np.bool_]:
        """(rows, columns) whether there is a corner."""
        return np.isfinite(self.xy_px[..., 0])


def fit_grid(
    picture: Picture,
    level: int,
    xy_px: Float,
    wanted: NDArray[np.bool_],
    board: CharucoBoard,
    before: GridFits | None = None,
) -> CornerGrid | None:
    """Fit corners at one level of the pyramid; None where too few are left to go on.

    Args:
        picture: (H, W) of that level.
        level: halvings of the picture.
        xy_px: (rows, columns, 2) corners in px of the picture itself, NaN where none is known.
        wanted: (rows, columns) where to look.
        board: the board that the grid is of.
        before: fits at the same level, which are not made again.
    """
    if not has_square(np.isfinite(xy_px[..., 0])):
        return None
    fits = _fitted(picture, at_level(xy_px, level), wanted, board, before)
    good = fits.good
    if not good.any():
        return None
    fitted = np.where(good[..., None], from_level(fits.xy_px, level), np.nan)
    sigma_px = np.where(good, fits.sigma_px * 2**level, np.nan)
    kept = inliers(fitted, sigma_px)
    fitted[~kept], sigma_px[~kept] = np.nan, np.nan
    blur_px = float(np.median(fits.blur_px[good])) * 2**level
    contrast = float(np.median(np.abs(fits.contrast[good])))
    return CornerGrid(fitted, sigma_px, blur_px, contrast, fits)


def has_square(found: NDArray[np.bool_]) -> bool:
    """Whether all corners of some square are there: without, a homography is not fixed."""
    return bool((found[:-1, :-1] & found[:-1, 1:] & found[1:, :-1] & found[1:, 1:]).any())


def _fitted(
    picture: Picture,
    xy_px: Float,
    wanted: NDArray[np.bool_],
    board: CharucoBoard,
    before: GridFits | None,
) -> GridFits:
    if before is None:
        nothing = np.full(wanted.shape, np.nan)
        before = GridFits(np.full(xy_px.shape, np.nan), nothing, nothing, nothing, nothing)
    new = wanted & ~before.tried
    flat = flat_grid(xy_px)
    around = padded_grid(xy_px, flat)
    down, right = np.gradient(around, axis=0), np.gradient(around, axis=1)
    start, down, right = (place[1:-1, 1:-1][new] for place in (around, down, right))
    area = np.abs(down[:, 0] * right[:, 1] - down[:, 1] * right[:, 0])
    axes = np.stack([right, down], axis=1)
    length = np.maximum(np.linalg.norm(axes, axis=2), 1e-9)
    axes /= length[..., None]
    side_px = area / length.max(axis=1)
    clear_px = (1 + board.marker_share) / 2 * side_px
    markers = _markers(flat, new, axes, area[:, None] / length, board)
    fit = fit_crossings(picture, start, axes, clear_px, markers)
    moved = np.linalg.norm(fit.xy_px - start, axis=1) / np.maximum(side_px, 1e-9)
    return GridFits(
        _put(before.xy_px, new, fit.xy_px),
        _put(before.sigma_px, new, fit.sigma_px),
        _put(before.blur_px, new, fit.blur_px),
        _put(before.contrast, new, fit.contrast),
        _put(before.moved, new, moved),
    )


def _markers(
    flat: Float, new: NDArray[np.bool_], axes: Float, apart_px: Float, board: CharucoBoard
) -> Markers:
    """Markers around corners.

    Perspective makes margins differ from side to side and grow along an edge. That alone would
    draw a corner towards the wider side; it is taken from the second derivatives of a homography,
    which the error of single corners does not reach.

    Args:
        flat: (rows + 2, columns + 2, 2) grid under a homography, with a ring around.
        new: (rows, columns) corners wanted, N of them.
        axes: (N, 2, 2) unit vectors along their rows and columns.
        apart_px: (N, 2) distance to the next row and column.
        board: says how wide margins are.
    """
    rows, columns = (np.diff(flat, 2, axis=axis) for axis in (0, 1))
    bend = np.stack([rows[:, 1:-1][new], columns[1:-1][new]], axis=1)
    twist = (flat[2:, 2:] - flat[2:, :-2] - flat[:-2, 2:] + flat[:-2, :-2])[new][:, None] / 4
    step_px = np.linalg.norm(
        np.stack([np.gradient(flat, axis=axis)[1:-1, 1:-1][new] for axis in (1, 0)], axis=1), axis=2
    )
    normal = np.stack([-axes[..., 1], axes[..., 0]], axis=-1)
    # Distances across a row grow down the board, those across a column against its order.
    grows = np.array([1.0, -1.0])
    margin = (1 - board.marker_share) / 2
    border = board.marker_share / board.bits_across
    uneven_px = margin**2 / 2 * (bend * normal).sum(axis=2)
    fan = margin * grows * (twist * normal).sum(axis=2) / step_px
    values = (margin * apart_px, border * apart_px, uneven_px, fan)
    return Markers(*values)


def _put(before: Float, where: NDArray[np.bool_], values: Float) -> Float:
    after = before.copy()
    after[where] = values
    return after
