"""Which saddle points of a picture are neighbours on a board: joined by an edge, as near as any."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
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
    # Longest first: where a point has several links along one direction, the shortest stays.
    order = np.argsort(-links.length_px, kind="stable")
    length_px = np.full((len(saddles), 2, 2), np.inf)
    for here, there in ((links.first, links.last), (links.last, links.first)):
        here, there = here[order], there[order]
        along = _along(saddles, here, there)
        axis = np.abs(along).argmax(axis=1)
        backward = (np.take_along_axis(along, axis[:, None], axis=1)[:, 0] < 0).astype(np.intp)
        nearest = np.full_like(chosen, -1)
        nearest[here, axis, backward] = there
        own_px = np.full_like(length_px, np.inf)
        own_px[here, axis, backward] = links.length_px[order]
        nearer = own_px < length_px
        chosen, length_px = np.where(nearer, nearest, chosen), np.where(nearer, own_px, length_px)
    shortest = length_px.min(axis=2, keepdims=True)
    return _mutual(np.where(length_px > _LONGEST_RATIO * shortest, -1, chosen))


def _along_axes(saddles: Saddles) -> _Links:
    """Pairs of opposite colours whose link leaves both ends along an axis."""
    x, y = saddles.xy_px.T.astype(np.float32)
    across, down = x - x[:, None], y - y[:, None]
    square = across * across + down * down
    along = np.zeros_like(square)
    for axis in (0, 1):
        axis_x, axis_y = saddles.axes[:, axis].T.astype(np.float32)
        part = axis_x[:, None] * across + axis_y[:, None] * down
        np.maximum(along, part * part, out=along)
    leaves = along > np.float32(1 - _MAX_SINE**2) * square
    leaves &= leaves.T
    leaves &= saddles.bright @ saddles.bright.T < _OPPOSITE
    first, last = np.divmod(np.flatnonzero(np.triu(leaves)), len(saddles))
    return _Links(first, last, np.hypot(*(saddles.xy_px[last] - saddles.xy_px[first]).T))


def _along(saddles: Saddles, here: Index, there: Index) -> Float:
    """(K, 2) how far one saddle lies along the axes of another, px."""
    apart = saddles.xy_px[there] - saddles.xy_px[here]
    axes = saddles.axes[here]
    return axes[..., 0] * apart[:, :1] + axes[..., 1] * apart[:, 1:]


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
