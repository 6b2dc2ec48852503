"""Which saddle points of a picture are neighbours on a board: joined by an edge, as near as any."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel
from rig.targets.edge_links import are_edges
from rig.targets.saddles import Saddles

Index = NDArray[np.intp]

_MAX_SINE = 0.4
"""A neighbour lies along the edge through the point, to 24 degrees: blur bends sheared corners."""
_OPPOSITE = -0.6
"""Neighbours have dark where the other has bright: cosine of twice the angle between."""
_LOOKED_AT = 24
"""Links of one point that are compared with the picture, shortest first."""
_SHORTEST_EDGE_PX = 9.0
"""Room for an edge between what blurs its two ends."""
_LONGEST_RATIO = 2.5
"""Steps of a lattice change slowly; a longer one has jumped over a corner."""


@dataclass(frozen=True, slots=True)
class _Links:
    """K pairs of saddles that may be neighbours; each pair once."""

    first: Index
    last: Index
    length_px: Float

    def part(self, which: NDArray[np.bool_]) -> "_Links":
        """Some of them."""
        return _Links(self.first[which], self.last[which], self.length_px[which])


def neighbours(saddles: Saddles, edges_of: NDArray[np.float32] | None) -> Index:
    """(N, 2, 2) nearest fitting saddle along each axis, forward and backward; -1 for none.

    A link counts only if both ends choose each other.

    Args:
        saddles: corners and chance points.
        edges_of: the picture, if links must be edges of it.
    """
    chosen = np.full((len(saddles), 2, 2), -1, np.intp)
    if len(saddles) < 2:
        return chosen
    links = _along_axes(saddles)
    if edges_of is not None:
        links = _shortest(links.part(links.length_px > _SHORTEST_EDGE_PX), len(saddles))
        links = links.part(are_edges(edges_of, saddles, links.first, links.last))
    length_px = np.full((len(saddles), 2, 2), np.inf)
    _choose(
        saddles.xy_px, saddles.axes, links.first, links.last, links.length_px, chosen, length_px
    )
    shortest = length_px.min(axis=2, keepdims=True)
    return _mutual(np.where(length_px > _LONGEST_RATIO * shortest, -1, chosen))


@kernel()
def _choose(
    xy_px: Float,
    axes: Float,
    first: Index,
    last: Index,
    link_px: Float,
    chosen: Index,
    length_px: Float,
) -> None:
    """Where a point has several links along one direction, take the shortest."""
    for k in range(2 * len(first)):
        link = k // 2
        here, there = (first[link], last[link]) if k % 2 == 0 else (last[link], first[link])
        x, y = xy_px[there, 0] - xy_px[here, 0], xy_px[there, 1] - xy_px[here, 1]
        along = axes[here, 0, 0] * x + axes[here, 0, 1] * y
        other = axes[here, 1, 0] * x + axes[here, 1, 1] * y
        axis = 1 if abs(other) > abs(along) else 0
        backward = 1 if (other if axis else along) < 0 else 0
        if link_px[link] < length_px[here, axis, backward]:
            length_px[here, axis, backward] = link_px[link]
            chosen[here, axis, backward] = there


def _along_axes(saddles: Saddles) -> _Links:
    """Pairs of opposite colours whose link leaves both ends along an axis."""
    first, last = _pairs(saddles.xy_px, saddles.axes, saddles.bright)
    return _Links(first, last, np.hypot(*(saddles.xy_px[last] - saddles.xy_px[first]).T))


@kernel()
def _pairs(xy_px: Float, axes: Float, bright: Float) -> tuple[Index, Index]:
    count = len(xy_px)
    first = np.empty(count * (count - 1) // 2, np.intp)
    last = np.empty(count * (count - 1) // 2, np.intp)
    found = 0
    for i in range(count):
        for j in range(i + 1, count):
            if bright[i, 0] * bright[j, 0] + bright[i, 1] * bright[j, 1] >= _OPPOSITE:
                continue
            x, y = xy_px[j, 0] - xy_px[i, 0], xy_px[j, 1] - xy_px[i, 1]
            least = (1 - _MAX_SINE**2) * (x * x + y * y)
            if _most_along(axes[i], x, y) > least and _most_along(axes[j], x, y) > least:
                first[found], last[found] = i, j
                found += 1
    return first[:found].copy(), last[:found].copy()


@kernel()
def _most_along(axes: Float, x: float, y: float) -> float:
    """Square of how far a step goes along either axis."""
    one, other = axes[0, 0] * x + axes[0, 1] * y, axes[1, 0] * x + axes[1, 1] * y
    return max(one * one, other * other)


def _shortest(links: _Links, count: int) -> _Links:
    """Links that are among the shortest of both their ends."""
    order = np.argsort(links.length_px, kind="stable")
    ends = np.stack([links.first[order], links.last[order]], axis=1).ravel()
    # Ends of one saddle side by side, its shortest link first.
    by_end = np.argsort(ends.astype(np.int16), kind="stable")
    begins = np.searchsorted(ends[by_end], np.arange(count))
    rank = np.empty(len(ends), np.intp)
    rank[by_end] = np.arange(len(ends)) - begins[ends[by_end]]
    kept = np.zeros(len(order), np.bool_)
    kept[order] = (rank.reshape(-1, 2) < _LOOKED_AT).all(axis=1)
    return links.part(kept)


def _mutual(chosen: Index) -> Index:
    flat = chosen.reshape(len(chosen), 4)
    back = (flat[chosen] == np.arange(len(chosen))[:, None, None, None]).any(axis=-1)
    return np.where((chosen >= 0) & back, chosen, -1)
