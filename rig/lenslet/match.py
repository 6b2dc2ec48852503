"""Whether a raw picture has its micro-images where a calibration has them."""

import numpy as np

from rig.arrays import Float
from rig.frames import GreyImage
from rig.lenslet.array import LensletArray, numbers_of
from rig.lenslet.lattice import ROW_SHIFT

_MOST = 20_000
_DARKER = 0.5
"""The dip between micro-images must be at least this part of what the white picture had."""
_SHALLOW = 0.02
"""A white picture whose dip is shallower than this part of its light tells nothing."""


def shows_the_lattice(raw: GreyImage, array: LensletArray) -> bool:
    """Tell whether the places between micro-images are dark, as the white picture had them.

    Args:
        raw: (H, W) any picture of the camera; a scene changes from lenslet to lenslet, but not in
            step with the lattice.
        array: of the camera.
    """
    rows, columns = np.nonzero(array.gains > 0.0)
    keep = np.linspace(0, len(rows) - 1, min(_MOST, len(rows))).astype(int)
    j, q = rows[keep] + array.first[1], columns[keep] + array.first[0]
    i = numbers_of(array.lattice.kind, q, j)
    centre_px = array.lattice.centres_px(i, j)
    # Where the most neighbours meet: the corner of a square cell, the middle of three lenslets.
    shift = (0.5, 0.5) if ROW_SHIFT[array.lattice.kind] == 0.0 else (1.0 / 3.0, 1.0 / 3.0)
    gap_px = array.lattice.centres_px(i + shift[0], j + shift[1])
    reach_px = array.vignetting.reach_px
    away = np.clip(gap_px - centre_px, -reach_px, reach_px)
    size = np.array(array.vignetting.size_px)
    inside = np.all((gap_px >= 1.0) & (gap_px <= size - 2.0), axis=1)
    white_dip = _dip(
        array.vignetting.light(centre_px[inside], np.zeros((int(inside.sum()), 2))),
        array.vignetting.light(centre_px[inside], away[inside]),
    )
    if white_dip < _SHALLOW:
        return True
    dip = _dip(_around(raw, centre_px[inside], array), _around(raw, gap_px[inside], array))
    return dip > _DARKER * white_dip


def _dip(bright: Float, dark: Float) -> float:
    total = float(bright.sum())
    return 0.0 if total <= 0.0 else 1.0 - float(dark.sum()) / total


def _around(raw: GreyImage, place_px: Float, array: LensletArray) -> Float:
    """Mean light of 2 x 2 pixels around places: of a Bayer picture, all of its colours."""
    column, row = np.floor(place_px).astype(int).T
    block = [raw[row + down, column + right] for down in (0, 1) for right in (0, 1)]
    return np.stack(block).mean(axis=0, dtype=np.float64) - array.dark_levels
