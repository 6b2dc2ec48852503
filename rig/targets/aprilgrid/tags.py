"""The bits in black quadrilaterals, and the tags that they spell."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.aprilgrid.board import BITS, tag_bits
from rig.targets.pyramid import Picture
from rig.targets.saddles import bilinear

_MOST_WRONG = 3
"""Bits of 36 that may be read wrongly; codes differ by 11 at least."""
_BORDER_SHARE = 0.85
"""Share of the border's bits that must be black."""
_PLACES_IN_BIT = (-0.2, 0.2)
"""Where a bit is sampled, in bits from its middle."""


@dataclass(frozen=True, slots=True)
class Tag:
    """One tag that was read."""

    number: int
    corners_px: Float
    """(4, 2): top left, top right, bottom right, bottom left of the upright tag."""
    wrong_bits: int


def read_tags(picture: Picture, quads_px: Float, *, border_bits: int, share: float) -> list[Tag]:
    """Read what the quadrilaterals spell; those that spell nothing are left out.

    Args:
        picture: (H, W) grey.
        quads_px: (Q, 4, 2) clockwise.
        border_bits: width of the black border.
        share: width of the white gap around a tag, in its sides.
    """
    if not len(quads_px):
        return []
    bits, readable = _bits(picture, quads_px, border_bits, share)
    seen = np.flatnonzero(readable)
    wrong = np.stack([_differences(np.rot90(bits[seen], q, axes=(1, 2))) for q in range(4)], axis=1)
    found: list[Tag] = []
    for place, differences in zip(seen.tolist(), wrong, strict=True):
        quarters, number = np.unravel_index(int(differences.argmin()), differences.shape)
        least = int(differences[quarters, number])
        if least <= _MOST_WRONG:
            corners_px = np.roll(quads_px[place], -int(quarters), axis=0)
            found.append(Tag(int(number), corners_px, least))
    return found


def _differences(bits: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(Q, tags) number of bits in which (Q, 6, 6) differ from every tag of the family."""
    read = bits.reshape(-1, BITS * BITS).astype(np.float32)
    known = tag_bits().reshape(-1, BITS * BITS).astype(np.float32)
    both = read @ known.T
    return np.rint(read.sum(axis=1)[:, None] + known.sum(axis=1) - 2 * both).astype(np.intp)


def _bits(
    picture: Picture, quads_px: Float, border_bits: int, share: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(Q, 6, 6) inner bits, True for white, and (Q,) whether a black border is around them."""
    across = BITS + 2 * border_bits
    picture_from_unit = homographies(quads_px)
    middles = (np.arange(across) + 0.5) / across
    fine = (middles[:, None] + np.array(_PLACES_IN_BIT) / across).ravel()
    v, u = np.meshgrid(fine, fine, indexing="ij")
    grey, inside = _look(picture, picture_from_unit, np.stack([u.ravel(), v.ravel()], axis=1))
    each = len(_PLACES_IN_BIT)
    levels = grey.reshape(-1, across, each, across, each).mean(axis=(2, 4))
    along = np.linspace(0.2, 0.8, 4)
    aside = [(-share / 2, a) for a in along] + [(1 + share / 2, a) for a in along]
    around, _ = _look(picture, picture_from_unit, np.array(aside + [(b, a) for a, b in aside]))
    border = np.ones((across, across), np.bool_)
    border[border_bits:-border_bits, border_bits:-border_bits] = False
    white, black = np.median(around, axis=1), np.median(levels[:, border], axis=1)
    above = levels > ((white + black) / 2)[:, None, None]
    framed = (~above[:, border]).mean(axis=1) >= _BORDER_SHARE
    inner = slice(border_bits, -border_bits)
    return above[:, inner, inner], framed & inside & (white > black)


def homographies(quads: Float) -> Float:
    """(Q, 3, 3) from the unit square (0, 0), (1, 0), (1, 1), (0, 1) to quadrilaterals (Q, 4, 2)."""
    unit = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    design = np.zeros((len(quads), 8, 8))
    for corner, (u, v) in enumerate(unit.tolist()):
        x, y = quads[:, corner, 0], quads[:, corner, 1]
        for row, value in ((2 * corner, x), (2 * corner + 1, y)):
            first = 3 * (row % 2)
            design[:, row, first : first + 3] = u, v, 1.0
            design[:, row, 6:] = np.stack([-u * value, -v * value], axis=1)
    numbers = np.linalg.solve(design, quads.reshape(-1, 8, 1))[..., 0]
    matrices = np.concatenate([numbers, np.ones((len(quads), 1))], axis=1)
    return np.asarray(matrices.reshape(-1, 3, 3), np.float64)


def _look(
    picture: Picture, picture_from_unit: Float, unit: Float
) -> tuple[Float, NDArray[np.bool_]]:
    """Grey (Q, P) at places (P, 2) of unit squares, and (Q,) whether all are in the picture."""
    points = np.concatenate([unit, np.ones((len(unit), 1))], axis=1)
    mapped = points @ picture_from_unit.transpose(0, 2, 1)
    xy_px = mapped[..., :2] / np.where(np.abs(mapped[..., 2:]) > 1e-9, mapped[..., 2:], 1e-9)
    last = np.array(picture.shape[::-1]) - 1
    within = np.clip(xy_px, 0, last)
    return bilinear(picture, within), np.asarray((within == xy_px).all(axis=(1, 2)))
