"""The bits in the squares of a lattice of corners."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.homography import fit_homography, grid_places, map_points
from rig.targets.saddles import bilinear

Picture = NDArray[np.float32]

_PLACES_IN_BIT = (-0.2, 0.2)
"""Where a bit is sampled, in bits from its middle."""
_BORDER_SHARE = 0.8
"""Share of the border's bits that must be black."""
_WHITER = 0.25
"""Least difference of margin and border, over the largest of a lattice."""


@dataclass(frozen=True, slots=True)
class ReadCells:
    """The squares of a lattice with one ring around it, and the bits read in them."""

    shape: tuple[int, int]
    """Rows and columns of squares: one more than of corners."""
    readable: NDArray[np.bool_]
    """(S,) whether a marker's border is there, row by row."""
    bits: NDArray[np.bool_]
    """(S, n, n) inner bits, True for white; rows and columns as on the lattice."""


@dataclass(frozen=True, slots=True)
class SampledCells:
    """Grey levels in the squares of a lattice with one ring around it."""

    shape: tuple[int, int]
    """Rows and columns of squares: one more than of corners."""
    levels: Float
    """(S, m, m) mean of every bit, border included, row by row."""
    margin: Float
    """(S,) median around the marker."""
    inside: NDArray[np.bool_]
    """(S,) whether all of a square is in view."""

    def read(self, *, inverted: bool = False) -> ReadCells:
        """Tell the bits apart; `inverted` for white markers on black."""
        sign = -1 if inverted else 1
        levels, white = sign * self.levels, sign * self.margin
        border = np.ones(levels.shape[1:], np.bool_)
        border[1:-1, 1:-1] = False
        black = np.median(levels[:, border], axis=1)
        middle = (white + black) / 2
        above = levels > middle[:, None, None]
        framed = (~above[:, border]).mean(axis=1) >= _BORDER_SHARE
        contrast = np.where(self.inside & framed, white - black, 0.0)
        readable = contrast > np.maximum(_WHITER * contrast.max(initial=0.0), 1e-6)
        return ReadCells(self.shape, readable, above[:, 1:-1, 1:-1])


def padded_grid(xy_px: Float, flat: Float | None = None) -> Float:
    """(R + 2, C + 2, 2) corners with missing ones and a ring around filled in.

    A homography tells where they lie; next to the border it is corrected by what it misses the
    nearest corner by, so that distortion is followed.

    Args:
        xy_px: (R, C, 2), NaN where there is none.
        flat: what `flat_grid` makes of them, where that is known.
    """
    found = np.isfinite(xy_px[..., 0])
    flat = flat_grid(xy_px) if flat is None else flat
    apart = np.where(found[..., None], xy_px - flat[1:-1, 1:-1], 0.0)
    return flat + np.pad(apart, ((1, 1), (1, 1), (0, 0)), mode="edge")


def flat_grid(xy_px: Float) -> Float:
    """(R + 2, C + 2, 2) where a homography through all corners puts them and a ring around."""
    found = np.isfinite(xy_px[..., 0])
    homography = fit_homography(grid_places(*found.shape)[found], xy_px[found])
    return map_points(homography, grid_places(found.shape[0] + 2, found.shape[1] + 2) - 1.0)


def sample_cells(picture: Picture, xy_px: Float, *, bits_across: int, share: float) -> SampledCells:
    """Sample the bits of a marker in every square.

    Args:
        picture: (H, W) grey.
        xy_px: (R, C, 2) corners of a lattice, NaN where none was found; at least 2 x 2.
        bits_across: bits of a marker with its border.
        share: side of a marker over the side of a square.
    """
    grid = padded_grid(xy_px)
    shape = (grid.shape[0] - 1, grid.shape[1] - 1)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2)
    square_from_unit = _homographies(quads.reshape(-1, 4, 2))
    bit = share / bits_across
    middles = 0.5 + bit * (np.arange(bits_across) - (bits_across - 1) / 2)
    fine = (middles[:, None] + bit * np.array(_PLACES_IN_BIT)).ravel()
    v, u = np.meshgrid(fine, fine, indexing="ij")
    grey, inside = _look(picture, square_from_unit, np.stack([u, v], axis=-1).reshape(-1, 2))
    per_bit = len(_PLACES_IN_BIT)
    levels = grey.reshape(-1, bits_across, per_bit, bits_across, per_bit).mean(axis=(2, 4))
    edge = (1 - share) / 4
    along = np.linspace(0.2, 0.8, 4)
    margin = [(edge, a) for a in along] + [(1 - edge, a) for a in along]
    around, _ = _look(picture, square_from_unit, np.array(margin + [(b, a) for a, b in margin]))
    return SampledCells(shape, levels, np.median(around, axis=1), inside)


def _homographies(quads: Float) -> Float:
    """(S, 3, 3) from the unit square to S quadrilaterals (S, 4, 2), clockwise from (0, 0).

    Closed form: P. Heckbert, "Fundamentals of Texture Mapping and Image Warping", 1989.
    """
    (x0, x1, x2, x3), (y0, y1, y2, y3) = quads[..., 0].T, quads[..., 1].T
    dx1, dx2, dx3 = x1 - x2, x3 - x2, x0 - x1 + x2 - x3
    dy1, dy2, dy3 = y1 - y2, y3 - y2, y0 - y1 + y2 - y3
    area = dx1 * dy2 - dx2 * dy1
    area = np.where(np.abs(area) > 1e-9, area, 1e-9)
    g, h = (dx3 * dy2 - dx2 * dy3) / area, (dx1 * dy3 - dx3 * dy1) / area
    one = np.ones_like(g)
    rows = [
        [x1 - x0 + g * x1, x3 - x0 + h * x3, x0],
        [y1 - y0 + g * y1, y3 - y0 + h * y3, y0],
        [g, h, one],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def _look(
    picture: Picture, square_from_unit: Float, unit: Float
) -> tuple[Float, NDArray[np.bool_]]:
    """Grey (S, P) at places (P, 2) of unit squares, and whether all of a square is in view."""
    points = np.concatenate([unit, np.ones((len(unit), 1))], axis=1)
    mapped = points @ square_from_unit.transpose(0, 2, 1)
    xy_px = mapped[..., :2] / np.where(np.abs(mapped[..., 2:]) > 1e-9, mapped[..., 2:], 1e-9)
    last = np.array(picture.shape[::-1]) - 1
    within = np.clip(xy_px, 0, last)
    return bilinear(picture, within), np.asarray((within == xy_px).all(axis=(1, 2)))
