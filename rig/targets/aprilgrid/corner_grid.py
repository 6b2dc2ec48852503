"""Corners of an AprilGrid fitted where its tags have them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.aprilgrid.board import AprilGrid
from rig.targets.aprilgrid.tags import Tag
from rig.targets.corner_fit import fit_crossings
from rig.targets.outliers import inliers
from rig.targets.pyramid import Picture, at_level, from_level

_LEAST_CONTRAST = 0.35
"""Of the median: a crossing fitted with less is not of the grid."""
_MOST_MOVED = 0.12
"""Way from where a corner is expected to where it is fitted, in sides of a tag."""
_MOST_SIGMAS = 6.0
"""Sigma of a corner, in medians: fitted to something else, such as a tag without squares beside."""
_NEAREST = 12
"""Corners about a place that tell where the next one is."""
_FEWEST = 4


@dataclass(frozen=True, slots=True)
class CornerGrid:
    """Corners at the grid's places, NaN where there is none."""

    xy_px: Float
    """(rows, columns, 2)."""
    sigma_px: Float
    """(rows, columns)."""
    blur_px: float
    contrast: float
    side_px: float
    """Median side of a tag, the shorter way."""

    @property
    def found(self) -> NDArray[np.bool_]:
        """(rows, columns) whether there is a corner."""
        return np.isfinite(self.xy_px[..., 0])


def rough_corners(tags: list[Tag], grid: AprilGrid) -> Float:
    """(rows, columns, 2) corners of the tags that were read, NaN elsewhere."""
    xy_px = np.full((grid.rows, grid.columns, 2), np.nan)
    row_of, column_of = np.empty(grid.tag_count, np.intp), np.empty(grid.tag_count, np.intp)
    rows, columns = np.indices(grid.tag_numbers.shape)
    row_of[grid.tag_numbers - grid.first_tag] = rows
    column_of[grid.tag_numbers - grid.first_tag] = columns
    for tag in tags:
        row, column = (2 * int(of[tag.number - grid.first_tag]) for of in (row_of, column_of))
        first, second, third, fourth = tag.corners_px
        xy_px[row, column], xy_px[row, column + 1] = first, second
        xy_px[row + 1, column + 1], xy_px[row + 1, column] = third, fourth
    return xy_px


def fit_corners(picture: Picture, level: int, xy_px: Float, grid: AprilGrid) -> CornerGrid | None:
    """Fit the corners that are known, then those around them; None where too few are left.

    Args:
        picture: (H, W) of one level of a pyramid.
        level: halvings of the picture.
        xy_px: (rows, columns, 2) px of the picture itself, to a pixel or two; NaN for none.
        grid: what they are of.
    """
    fitted = _fitted(picture, level, xy_px, np.isfinite(xy_px[..., 0]), grid)
    if fitted is None:
        return None
    return _fitted(picture, level, fitted.xy_px, _tags_begun(fitted.found), grid) or fitted


def _tags_begun(found: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(rows, columns) corners of tags of which some corner is known, and of those beside them."""
    rows, columns = found.shape
    by_tag = found.reshape(rows // 2, 2, columns // 2, 2).any(axis=(1, 3))
    near = np.pad(by_tag, 1)
    begun = by_tag | near[:-2, 1:-1] | near[2:, 1:-1] | near[1:-1, :-2] | near[1:-1, 2:]
    return np.repeat(np.repeat(begun, 2, axis=0), 2, axis=1)


def _fitted(
    picture: Picture, level: int, xy_px: Float, wanted: NDArray[np.bool_], grid: AprilGrid
) -> CornerGrid | None:
    known = np.isfinite(xy_px[..., 0])
    if int(known.sum()) < _FEWEST:
        return None
    places = grid.places
    start, axes, side_px = _expected(places[wanted], places[known], at_level(xy_px, level)[known])
    own = known[wanted]
    start[own] = at_level(xy_px[wanted][own], level)
    good = np.isfinite(start).all(axis=1) & (side_px > 0)
    fit = fit_crossings(
        picture, np.where(good[:, None], start, 0.0), axes, grid.clear_share * side_px
    )
    row, column = np.nonzero(wanted)
    signed = np.where((row + column) % 2 == 0, fit.contrast, -fit.contrast)
    usable = good & np.isfinite(fit.xy_px[:, 0]) & np.isfinite(fit.sigma_px) & (fit.sigma_px > 0)
    if not usable.any():
        return None
    usual = float(np.median(signed[usable]))
    usable &= signed > _LEAST_CONTRAST * abs(usual)
    moved = np.linalg.norm(np.nan_to_num(fit.xy_px) - start, axis=1)
    usable &= moved < _MOST_MOVED * side_px
    if not usable.any():
        return None
    usable &= fit.sigma_px < _MOST_SIGMAS * np.median(fit.sigma_px[usable])
    found, sigma_px = np.full(xy_px.shape, np.nan), np.full(known.shape, np.nan)
    found[row[usable], column[usable]] = from_level(fit.xy_px[usable], level)
    sigma_px[row[usable], column[usable]] = fit.sigma_px[usable] * 2**level
    kept = inliers(found, sigma_px, places)
    found[~kept], sigma_px[~kept] = np.nan, np.nan
    return CornerGrid(
        found,
        sigma_px,
        float(np.median(fit.blur_px[usable])) * 2**level,
        float(np.median(np.abs(fit.contrast[usable]))),
        float(np.median(side_px[usable])) * 2**level,
    )


def _expected(wanted: Float, places: Float, xy_px: Float) -> tuple[Float, Float, Float]:
    """Where places (N, 2) of the grid appear, unit axes (N, 2, 2) there, and sides of a tag (N,).

    Each by a homography through the known corners nearest to it, so that a lens is followed.

    Args:
        wanted: (N, 2).
        places: (K, 2) of the known corners.
        xy_px: (K, 2) their pixels.
    """
    apart = np.abs(wanted[:, None] - places).max(axis=2)
    near = np.argsort(apart, axis=1, kind="stable")[:, :_NEAREST]
    x, y = np.moveaxis(places[near] - wanted[:, None], -1, 0)
    middle_px = xy_px[near].mean(axis=1)
    u, v = np.moveaxis(xy_px[near] - middle_px[:, None], -1, 0)
    one, none = np.ones_like(x), np.zeros_like(x)
    rows = [
        np.stack([x, y, one, none, none, none, -x * u, -y * u], axis=-1),
        np.stack([none, none, none, x, y, one, -x * v, -y * v], axis=-1),
    ]
    normal = sum(np.einsum("nki,nkj->nij", row, row) for row in rows)
    side = sum(np.einsum("nki,nk->ni", row, value) for row, value in zip(rows, (u, v), strict=True))
    h = (np.linalg.pinv(normal, hermitian=True) @ np.asarray(side)[..., None])[..., 0]
    # The wanted place is the origin of its own homography: value and slopes are its numbers.
    start = middle_px + h[:, [2, 5]]
    right = h[:, [0, 3]] - h[:, [6]] * h[:, [2, 5]]
    down = h[:, [1, 4]] - h[:, [7]] * h[:, [2, 5]]
    along = np.stack([right, down], axis=1)
    length = np.maximum(np.linalg.norm(along, axis=2), 1e-9)
    area = np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])
    return start, along / length[..., None], area / length.max(axis=1)
