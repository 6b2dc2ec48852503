"""Where light falls on the pictures of a view: a circular fisheye leaves their corners black."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.frames import Frame
from rig.geometry.bundle.part import COLUMNS, ROWS, Part

_BLACK_SHARE = 0.04
"""Of the full scale: what black level, noise and stray light leave in a corner without light."""

Brightness = NDArray[np.float32]
"""(ROWS, COLUMNS) mean grey value about each node of a picture, as a share of the full scale."""


def brightness_of(frame: Frame) -> Brightness:
    """Return how bright the parts of a picture are."""
    image = frame.image
    top, left = _starts(image.shape[0], ROWS), _starts(image.shape[1], COLUMNS)
    wide = np.add.reduceat(image, left, axis=1, dtype=np.uint32)
    sums = np.add.reduceat(wide, top, axis=0, dtype=np.float64)
    areas = np.outer(np.diff([*top, image.shape[0]]), np.diff([*left, image.shape[1]]))
    return (sums / areas / frame.full_scale).astype(np.float32)


def _starts(length_px: int, nodes: int) -> NDArray[np.intp]:
    """(N,) first pixels of what lies nearest to each node along a side."""
    between = (np.arange(nodes - 1) + 0.5) * (length_px - 1) / (nodes - 1)
    return np.concatenate([[0], np.ceil(between)]).astype(np.intp)


def lit_part(brightness: Sequence[Brightness]) -> Part | None:
    """Return the nodes that are not black in all pictures of one view.

    Something dark may stand in a corner in all of them; only where all four corners are black does
    the lens not reach them.

    Args:
        brightness: of every picture.

    Returns:
        None where the lens fills the picture.
    """
    lit = np.max(brightness, axis=0) > _BLACK_SHARE
    if lit[[0, 0, -1, -1], [0, -1, 0, -1]].any() or not lit.any():
        return None
    return lit
