"""Grow a lattice of saddle points by walking from each to its neighbours."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.links import neighbours
from rig.targets.saddles import Saddles
from rig.targets.smooth_lines import smooth_triples

RING_PX = 3.5
"""Radius of the ring around saddles whose lattices are plain: squares of 6 px are larger."""
_FEWEST = 9
_LATTICES = 3
_MAX_BEND = 0.15
"""Change of step, in steps, from one square to the next: perspective stays below, and the bend of
a lens changes by less."""
_LOOSE_PX = 0.7
"""What three corners may add to it before they are refined."""


@dataclass(frozen=True, slots=True)
class Lattice:
    """Corners found on a grid of rows and columns; right-handed, otherwise in any orientation."""

    xy_px: Float
    """(R, C, 2), NaN where no corner was found."""
    bright: Float
    """(R, C, 2) unit vector into a bright quadrant, doubled in angle; NaN where none."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.xy_px.shape[0], self.xy_px.shape[1]

    def part(self, places: tuple[slice, slice]) -> "Lattice":
        """Some of the rows and columns."""
        return Lattice(self.xy_px[places], self.bright[places])

    @property
    def found(self) -> NDArray[np.bool_]:
        """(R, C) whether there is a corner."""
        return np.isfinite(self.xy_px[..., 0])

    @property
    def side_px(self) -> float:
        """Median distance of neighbours, px; NaN without any."""
        steps = np.concatenate(
            [np.linalg.norm(np.diff(self.xy_px, axis=axis), axis=-1).ravel() for axis in (0, 1)]
        )
        steps = steps[np.isfinite(steps)]
        return float(np.median(steps)) if steps.size else float("nan")


def grow_lattices(
    saddles: Saddles, *, edges_of: NDArray[np.float32] | None = None, fewest: int = _FEWEST
) -> list[Lattice]:
    """Join saddles into lattices, largest first.

    Args:
        saddles: corners and chance points.
        edges_of: the picture, for boards that have saddles between their corners: links must then
            be edges of it.
        fewest: corners below which a lattice is chance; at least 9 also asks for 3 x 3.
    """
    neighbour = neighbours(saddles, edges_of)
    linked = np.flatnonzero((neighbour >= 0).any(axis=(1, 2))).tolist()
    unseen = set(linked)
    lattices: list[Lattice] = []
    for seed in linked:
        if seed not in unseen:
            continue
        placed = _walk(seed, neighbour, saddles.axes, unseen)
        if len(placed) < fewest:
            continue
        lattice = without_strays(_on_grid(placed, saddles), 0.5)
        if min(lattice.shape) >= (3 if fewest >= _FEWEST else 2):
            lattices.append(lattice)
    return sorted(lattices, key=lambda lattice: -int(lattice.found.sum()))


def plain_lattices(saddles: Saddles, picture: NDArray[np.float32]) -> list[Lattice]:
    """The largest lattices of a picture in which saddles are joined as on a bare checkerboard."""
    del picture
    return grow_lattices(saddles)[:_LATTICES]


def _walk(
    seed: int, neighbour: NDArray[np.intp], axes: Float, unseen: set[int]
) -> dict[tuple[int, int], int]:
    """Give every saddle reachable from the seed its (row, column); takes them out of `unseen`."""
    right, down = axes[seed]
    if right[0] * down[1] - right[1] * down[0] < 0:
        down = -down
    placed = {(0, 0): seed}
    unseen.discard(seed)
    queue: list[tuple[int, int, int, Float, Float]] = [(0, 0, seed, right, down)]
    for row, column, index, right, down in queue:
        for axis in (0, 1):
            own = axes[index, axis]
            is_row = abs(float(own @ down)) > abs(float(own @ right))
            forward = float(own @ (down if is_row else right)) > 0
            for direction in (0, 1):
                other = int(neighbour[index, axis, direction])
                step = 1 if forward == (direction == 0) else -1
                place = (row + step, column) if is_row else (row, column + step)
                if other not in unseen or place in placed:
                    continue
                placed[place] = other
                unseen.discard(other)
                queue.append((*place, other, *_carried(axes[other], right, down)))
    return placed


def _carried(axes: Float, right: Float, down: Float) -> tuple[Float, Float]:
    """The neighbour's own axes, named and signed like those of the point we come from."""
    first, second = axes
    if abs(float(first @ right)) < abs(float(second @ right)):
        first, second = second, first
    return first * np.sign(first @ right), second * np.sign(second @ down)


def _on_grid(placed: dict[tuple[int, int], int], saddles: Saddles) -> Lattice:
    places = np.array(list(placed))
    places -= places.min(axis=0)
    rows, columns = places.max(axis=0) + 1
    xy_px = np.full((rows, columns, 2), np.nan)
    bright = np.full((rows, columns, 2), np.nan)
    index = list(placed.values())
    xy_px[places[:, 0], places[:, 1]] = saddles.xy_px[index]
    bright[places[:, 0], places[:, 1]] = saddles.bright[index]
    return Lattice(xy_px, bright)


def without_strays(lattice: Lattice, share: float) -> Lattice:
    """Drop points that lie on no smooth line, then outer lines that are mostly empty.

    Args:
        lattice: As it was walked; chance saddles beside the board may have joined it.
        share: Least share of its places that an outer row or column must have.
    """
    smooth = _on_smooth_lines(lattice.xy_px)[..., None]
    xy_px = np.where(smooth, lattice.xy_px, np.nan)
    bright = np.where(smooth, lattice.bright, np.nan)
    lattice = Lattice(xy_px, bright)
    while min(lattice.shape) > 1:
        filled, rest = min(_ends(lattice, axes=(0, 1)), key=lambda end: end[0])
        if filled >= share:
            break
        lattice = lattice.part(rest)
    return lattice


def cut_to_size(lattice: Lattice, shape: tuple[int, int], share: float) -> Lattice | None:
    """Cut outer lines that are less than `share` full until the shape is reached, if it can be."""
    for axis in (0, 1):
        while lattice.shape[axis] > shape[axis]:
            filled, rest = min(_ends(lattice, axes=(axis,)), key=lambda end: end[0])
            if filled >= share:
                return None
            lattice = lattice.part(rest)
    return lattice if lattice.shape == shape else None


def _ends(lattice: Lattice, *, axes: tuple[int, ...]) -> list[tuple[float, tuple[slice, slice]]]:
    """For every outer line across the axes: how full it is, and the lattice without it."""
    ends: list[tuple[float, tuple[slice, slice]]] = []
    for axis in axes:
        lines = np.moveaxis(lattice.found, axis, 0)
        for line, rest in ((lines[0], slice(1, None)), (lines[-1], slice(None, -1))):
            part = (rest, slice(None)) if axis == 0 else (slice(None), rest)
            ends.append((float(line.mean()), part))
    return ends


def _on_smooth_lines(xy_px: Float) -> NDArray[np.bool_]:
    """(R, C) False where every row or every column of three that holds the point is broken."""
    keep = np.ones(xy_px.shape[:2], np.bool_)
    for points, kept in ((xy_px, keep), (xy_px.transpose(1, 0, 2), keep.T)):
        if len(points) < 3:
            continue
        smooth = smooth_triples(points, _MAX_BEND, _LOOSE_PX)
        known = np.isfinite(points[..., 0])
        whole = known[2:] & known[1:-1] & known[:-2]
        broken, good = np.zeros_like(kept), np.zeros_like(kept)
        for place in (slice(None, -2), slice(1, -1), slice(2, None)):
            broken[place] |= whole & ~smooth
            good[place] |= whole & smooth
        kept &= good | ~broken
    return keep
