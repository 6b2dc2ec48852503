"""Which views saw the board together, and the chain from the reference to every other view."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.errors import CalibrationError
from rig.geometry.bundle.observations import Observations


def shared_pictures(observed: Observations, view_count: int) -> NDArray[np.int64]:
    """(V, V) how many pictures each pair of views has in common; the diagonal counts its own."""
    shows = np.zeros((len(observed.pictures), view_count), np.int64)
    shows[observed.picture, observed.view] = 1
    return np.einsum("nv,nw->vw", shows, shows)


def spanning_tree(
    shared: NDArray[np.int64], reference: int, names: Sequence[str]
) -> list[tuple[int, int]]:
    """Chain every view to the reference through the pairs that share most pictures.

    Prim's algorithm; equal counts are settled by the lower index.

    Args:
        shared: (V, V) of `shared_pictures`.
        reference: index of the view to start from.
        names: of the views, for the message.

    Returns:
        (known view, new view) in the order in which they can be chained.

    Raises:
        CalibrationError: some views share no picture with the others.
    """
    reached, edges = [reference], []
    missing = [view for view in range(len(shared)) if view != reference]
    while missing:
        count, known, new = max(
            ((int(shared[known, new]), known, new) for known in reached for new in missing),
            key=lambda edge: (edge[0], -edge[1], -edge[2]),
        )
        if count == 0:
            raise CalibrationError(
                f"{_listed(names, missing)} asked for in the frame of {names[reference]}, but no "
                f"picture shows the board to one of them and to {_listed(names, reached)} at "
                "once",
                advice="take pictures in which the views overlap",
            )
        edges.append((known, new))
        reached.append(new)
        missing.remove(new)
    return edges


def _listed(names: Sequence[str], views: Sequence[int]) -> str:
    return ", ".join(names[view] for view in sorted(views))
