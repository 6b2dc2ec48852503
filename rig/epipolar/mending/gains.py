"""Gain and offset of views whose grey values are paired with those of the reference."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

_ROUNDS = 4


@dataclass(frozen=True, slots=True)
class Gains:
    """Reference grey = gain * grey + offset, one of each for every view."""

    gain: Float
    """(V,)."""
    offset: Float
    """(V,) grey levels of the reference."""

    @classmethod
    def none(cls, views: int) -> "Gains":
        """Return those of views that are alike already."""
        return cls(np.ones(views), np.zeros(views))

    def of(self, level: float) -> Float:
        """One grey level of every view, on the scale of the reference, (V,)."""
        return self.gain * level + self.offset

    def after(self, first: "Gains") -> "Gains":
        """Return what applying others first and then these comes to."""
        return Gains(self.gain * first.gain, self.gain * first.offset + self.offset)

    def misfit(self, grey: NDArray[np.floating], target: NDArray[np.floating]) -> Float:
        """Reference grey values (N,) less those told by grey values (V, N), (V, N)."""
        return target - (self.gain[:, None] * grey + self.offset[:, None])


def fit_gains(
    grey: NDArray[np.floating], target: NDArray[np.floating], useful: NDArray[np.bool_]
) -> Gains:
    """Fit robust lines, all views at once; symmetric, so that noise does not flatten them.

    Args:
        grey: (V, N).
        target: (N,) grey values of the reference.
        useful: (V, N) pairs that count, at least one for every view.
    """
    y = target.astype(np.float64)
    centre = float(np.median(y))
    x, y = grey.astype(np.float64) - centre, y - centre  # moments near zero keep their digits
    xx, yy, counts = x * x, y * y, useful.astype(np.float64)
    every = np.ones_like(y)
    number, sum_y, sum_yy = (counts @ moment for moment in (every, y, yy))
    spread = np.sqrt(np.maximum(sum_yy / number - (sum_y / number) ** 2, 0))
    smallest = 1e-3 * spread + 1e-9
    gain = np.ones(len(x))
    offset = middle(y[None], useful) - middle(x, useful)
    for _ in range(_ROUNDS):
        square = Gains(gain, offset).misfit(x, y) ** 2
        scale = (1.5 * np.sqrt(middle(square, useful)) + smallest) ** 2
        weight = counts / (scale[:, None] + square)
        total = weight.sum(axis=1)
        mean_y, power_y = weight @ y / total, weight @ yy / total
        mean_x, power_x = (np.einsum("ij,ij->i", weight, moment) / total for moment in (x, xx))
        var_x, var_y = power_x - mean_x**2, power_y - mean_y**2
        gain = np.ones(len(x))
        np.divide(var_y, var_x, out=gain, where=(var_x > 0) & (var_y > 0))
        gain = np.sqrt(gain)
        offset = mean_y - gain * mean_x
    return Gains(gain, offset + centre - gain * centre)


def middle(values: NDArray[np.floating], useful: NDArray[np.bool_]) -> Float:
    """Median of the useful values of each row, (V,); of two in the middle, the larger.

    Args:
        values: (V, N), or (1, N) for all rows alike.
        useful: (V, N).
    """
    ranked = np.sort(np.where(useful, values, np.inf), axis=1)
    half = np.count_nonzero(useful, axis=1) // 2
    return np.take_along_axis(ranked, half[:, None], axis=1)[:, 0].astype(np.float64)
