"""Maps as whole steps: half the bytes of a float, and no more lost than half a step."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.compute.kernel import kernel

_MOST_STEPS = 65000
_FINEST = 1e-4


@dataclass(frozen=True, slots=True)
class Packed:
    """A map; a value is `low + (steps - 1) * step`, none is there where steps are 0."""

    steps: NDArray[np.uint16]
    """(H, W)."""
    step: float
    """In the unit of the map."""
    low: float
    """In the unit of the map."""


def packed(values: NDArray[np.float32], *, low: float | None = 0.0) -> Packed:
    """Return a map by the smallest of 1, 2 and 5 times a power of ten with which all of it fits.

    Args:
        values: (H, W), NaN where there is none.
        low: no value is smaller; None to look for the smallest.
    """
    highest = float(np.fmax.reduce(values, axis=None, initial=-np.inf))
    if highest == -math.inf:
        return Packed(np.zeros(values.shape, np.uint16), _FINEST, 0.0)
    if low is None:
        low = float(np.fmin.reduce(values, axis=None))
    step = step_of(highest - low)
    steps = np.empty(values.shape, np.uint16)
    _count_steps(values, np.float32(low), np.float32(1.0 / step), steps)
    return Packed(steps, step, low)


@kernel()
def _count_steps(
    values: NDArray[np.float32], low: np.float32, scale: np.float32, steps: NDArray[np.uint16]
) -> None:
    for row in range(values.shape[0]):
        for column in range(values.shape[1]):
            value = values[row, column]
            is_known = value == value  # NaN is not
            counted = (value - low) * scale + np.float32(1.5) if is_known else np.float32(0.0)
            steps[row, column] = np.uint16(counted)


def step_of(value: float) -> float:
    """Return the step by which values of up to this one are counted."""
    least = max(value / _MOST_STEPS, _FINEST)
    power = 10.0 ** math.floor(math.log10(least))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= least * (1.0 - 1e-9))


def as_8_bit(image: NDArray[np.uint8] | NDArray[np.uint16], bits: int) -> NDArray[np.uint8]:
    """Return grey values of so many bits by their highest eight."""
    if image.dtype == np.uint8:
        return np.asarray(image, np.uint8)
    return (image >> max(bits - 8, 0)).astype(np.uint8)
