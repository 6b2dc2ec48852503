"""Maps as whole steps: half the bytes of a float, and no more lost than half a step."""

import math

import numpy as np
from numpy.typing import NDArray

NO_VALUE = -32768
"""Among signed multiples: none is there."""
_MOST_STEPS = 65000
_FINEST = 1e-4


def packed(values: NDArray[np.float32]) -> tuple[NDArray[np.uint16], float]:
    """Return a map of positive values as multiples of a step, and the step.

    The step is the smallest of 1, 2 and 5 times a power of ten with which the largest value fits.

    Args:
        values: (H, W), 0 or more; NaN where there is none.

    Returns:
        (H, W) multiples, 0 where there is none (and only there: what rounds to 0 becomes 1); and
        the step in the unit of the values.
    """
    largest = float(np.fmax.reduce(values, axis=None, initial=0.0))
    step = step_of(largest)
    steps = values * np.float32(1.0 / step)
    with np.errstate(invalid="ignore"):
        np.rint(steps, out=steps)
        known = steps >= 0.0
        # `fmax` takes the number beside NaN: no map of NaN is cast, which nothing defines.
        np.fmax(steps, np.float32(1.0), out=steps)
    return np.multiply(steps, known, out=steps).astype(np.uint16), step


def packed_signed(values: NDArray[np.float32]) -> tuple[NDArray[np.int16], float]:
    """Return a map of values of either sign as multiples of a step, and the step.

    Args:
        values: (H, W), NaN where there is none.

    Returns:
        (H, W) multiples, `NO_VALUE` where there is none; and the step in the unit of the values.
    """
    magnitude = np.abs(values)
    step = step_of(2.0 * float(np.fmax.reduce(magnitude, axis=None, initial=0.0)))
    steps = values * np.float32(1.0 / step)
    np.rint(steps, out=steps)
    steps[np.isnan(steps)] = NO_VALUE
    return steps.astype(np.int16), step


def step_of(largest: float) -> float:
    """Return the step by which values of up to `largest` are counted."""
    least = max(largest / _MOST_STEPS, _FINEST)
    power = 10.0 ** math.floor(math.log10(least))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= least * (1.0 - 1e-9))


def as_8_bit(image: NDArray[np.uint8] | NDArray[np.uint16], bits: int) -> NDArray[np.uint8]:
    """Return grey values of so many bits by their highest eight."""
    if image.dtype == np.uint8:
        return np.asarray(image, np.uint8)
    return (image >> max(bits - 8, 0)).astype(np.uint8)
