"""One mark per kind of stop, in every plot: shape tells the direction, filling the role."""

from collections.abc import Sequence
from typing import Any

from rig.curve import CurvePoint
from rig.report.figures import BLUE, VERMILLION, Axes

# Larger and beneath, so that two visits of one distance are both seen.
_BENEATH: dict[str, Any] = {"markersize": 7.5, "zorder": 1.9}
_OPEN: dict[str, Any] = {"mfc": "white", "mec": VERMILLION, "mew": 1.2}
_MARKS: dict[tuple[str, str], tuple[str, dict[str, Any]]] = {
    ("fit", "forward"): ("fit, forward", {"marker": "o", "mfc": BLUE, "mec": BLUE}),
    ("fit", "backward"): ("fit, backward", {"marker": "<", "mfc": BLUE, "mec": BLUE, **_BENEATH}),
    ("holdout", "forward"): ("held out, forward", {"marker": "D", **_OPEN}),
    ("holdout", "backward"): ("held out, backward", {"marker": "<", **_OPEN, **_BENEATH}),
}


def plot_stops(axes: Axes, points: Sequence[CurvePoint], values: Sequence[float]) -> None:
    """Plot one value per stop against distance, labelled for a legend."""
    for kind, (label, style) in _MARKS.items():
        chosen = [
            (point.distance_mm, value)
            for point, value in zip(points, values, strict=True)
            if (point.role, point.direction) == kind
        ]
        if chosen:
            x, y = zip(*chosen, strict=True)
            axes.plot(x, y, linestyle="none", label=label, **style)
