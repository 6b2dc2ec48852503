"""Grow a lattice of saddle points by walking from each to its neighbours."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel
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
    is_seen = np.asarray((neighbour < 0).all(axis=(1, 2)))
    taken = np.zeros((2 * len(saddles) + 1, 2 * len(saddles) + 1), np.bool_)
    lattices: list[Lattice] = []
    for seed in range(len(saddles)):
        if is_seen[seed]:
            continue
        index, places = _walk(seed, neighbour, saddles.axes, is_seen, taken)
        if len(index) < fewest:
            continue
        lattice = without_strays(_on_grid(index, places, saddles), 0.5)
        if min(lattice.shape) >= (3 if fewest >= _FEWEST else 2):
            lattices.append(lattice)
    return sorted(lattices, key=lambda lattice: -int(lattice.found.sum()))


def plain_lattices(saddles: Saddles, picture: NDArray[np.float32]) -> list[Lattice]:
    """The largest lattices of a picture in which saddles are joined as on a bare checkerboard."""
    del picture
    return grow_lattices(saddles)[:_LATTICES]


@kernel()
def _walk(
    seed: int,
    neighbour: NDArray[np.intp],
    axes: Float,
    is_seen: NDArray[np.bool_],
    taken: NDArray[np.bool_],
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Give every saddle reachable from the seed its (row, column), breadth first.

    Args:
        seed: where to begin.
        neighbour: (N, 2, 2) as `rig.targets.links.neighbours` gives them.
        axes: (N, 2, 2) of the saddles.
        is_seen: (N,) which saddles have a place already; those reached are marked.
        taken: (2 N + 1, 2 N + 1) all false, before and after.

    Returns:
        (M,) saddles, and (M, 2) their places.
    """
    count = len(axes)
    index, place = np.empty(count, np.intp), np.empty((count, 2), np.intp)
    frame = np.empty((count, 2, 2))  # To the right and down, as seen at each saddle.
    index[0], place[0] = seed, 0
    frame[0] = axes[seed]
    if frame[0, 0, 0] * frame[0, 1, 1] - frame[0, 0, 1] * frame[0, 1, 0] < 0:
        frame[0, 1] = -frame[0, 1]
    taken[count, count] = True
    is_seen[seed] = True
    reached, at = 1, 0
    while at < reached:
        here = index[at]
        for axis in range(2):
            across, down = (
                _dot(axes[here, axis], frame[at, 0]),
                _dot(axes[here, axis], frame[at, 1]),
            )
            is_row = abs(down) > abs(across)
            is_forward = (down if is_row else across) > 0
            for direction in range(2):
                other = neighbour[here, axis, direction]
                step = 1 if is_forward == (direction == 0) else -1
                row = place[at, 0] + (step if is_row else 0)
                column = place[at, 1] + (0 if is_row else step)
                if other < 0 or is_seen[other] or taken[count + row, count + column]:
                    continue
                is_seen[other] = taken[count + row, count + column] = True
                index[reached], place[reached, 0], place[reached, 1] = other, row, column
                _carry(axes[other], frame[at], frame[reached])
                reached += 1
        at += 1
    for k in range(reached):
        taken[count + place[k, 0], count + place[k, 1]] = False
    return index[:reached].copy(), place[:reached].copy()


@kernel()
def _dot(a: Float, b: Float) -> float:
    return a[0] * b[0] + a[1] * b[1]


@kernel()
def _carry(axes: Float, frame: Float, own: Float) -> None:
    """A neighbour's own axes, named and signed like those of the point we come from."""
    first = 1 if abs(_dot(axes[0], frame[0])) < abs(_dot(axes[1], frame[0])) else 0
    for k in range(2):
        axis = axes[first if k == 0 else 1 - first]
        own[k] = axis * np.sign(_dot(axis, frame[k]))


def _on_grid(index: NDArray[np.intp], places: NDArray[np.intp], saddles: Saddles) -> Lattice:
    places = places - places.min(axis=0)
    rows, columns = places.max(axis=0) + 1
    xy_px = np.full((rows, columns, 2), np.nan)
    bright = np.full((rows, columns, 2), np.nan)
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
