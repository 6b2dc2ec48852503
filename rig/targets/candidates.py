"""Lattices of a picture, one resolution after the other: those that a target is looked for in."""

from collections.abc import Callable, Iterator

import numpy as np

from rig.arrays import Float
from rig.targets.lattice import Lattice
from rig.targets.magnified import densest_part
from rig.targets.pyramid import Picture, from_level, search_order
from rig.targets.saddles import Saddles, find_saddles

_SMOOTH_PX = 1.0
_MOST_SIDE_PX = 24.0
"""Larger squares are seen without; of them, the part may hold only some."""


def candidates(
    pictures: list[Picture], ring_px: float, grow: Callable[[Saddles, Picture], list[Lattice]]
) -> Iterator[tuple[int, Lattice]]:
    """Yield lattices in px of the picture itself, and the level that shows them.

    Last comes a part of the picture at twice its size: what is small and steep there has squares
    or margins of a pixel or two, which the smoothing before a search for saddles closes.

    Args:
        pictures: the picture and its halvings.
        ring_px: radius of the ring around saddles, px of every level.
        grow: joins the saddles of a picture.
    """
    crowded: Float = np.empty((0, 2))
    for level in search_order(pictures):
        saddles = find_saddles(pictures[level], smooth_px=_SMOOTH_PX, ring_px=ring_px)
        if level == 0:
            crowded = saddles.xy_px
        for lattice in grow(saddles, pictures[level]):
            yield level, Lattice(from_level(lattice.xy_px, level), lattice.bright)
    part = densest_part(pictures[0], crowded)
    if part is not None:
        magnified, first_px = part
        saddles = find_saddles(magnified, smooth_px=_SMOOTH_PX, ring_px=ring_px)
        for lattice in grow(saddles, magnified):
            if lattice.side_px < 2 * _MOST_SIDE_PX:
                yield 0, Lattice(from_level(lattice.xy_px, -1) + first_px, lattice.bright)
