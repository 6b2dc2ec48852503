"""What a change of slope between two neighbours costs: less where the picture has an edge."""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.scales import Scales

_LOW_PENALTY, _JUMP_PENALTY, _EDGE = 8, 24, 4.0
_JUMP_PER_LABEL = 0.4
"""The more labels there are to jump to, the more often one of them fits by chance."""


def fading_penalties(
    grey: NDArray[np.float32], bounds: tuple[float, float]
) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Penalties that fall to the lower bound at the grey edges of a picture, right and down."""
    low, high = bounds
    edges = [np.abs(np.diff(grey, axis=a, prepend=grey.take([0], axis=a))) for a in (1, 0)]
    # What most neighbours differ by is no edge.
    scale = np.float32(_EDGE * float(np.mean([edge.mean() for edge in edges])) + 1e-6)
    across, down = ((low + (high - low) * np.exp(-edge / scale)).astype(np.int16) for edge in edges)
    return across, down


def jump_penalties(
    grey: NDArray[np.float32], scales: Scales, labels: int
) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Penalty between a pixel and its left neighbour, and between it and the one above."""
    high = max(_JUMP_PENALTY, _LOW_PENALTY + _JUMP_PER_LABEL * labels)
    penalties: list[NDArray[np.int16]] = []
    for axis in (1, 0):
        edge = np.abs(np.diff(grey, axis=axis, prepend=grey.take([0], axis=axis)))
        fade = np.exp(-edge / np.float32(scales.likeness))
        penalties.append((_LOW_PENALTY + (high - _LOW_PENALTY) * fade).astype(np.int16))
    return penalties[0], penalties[1]
