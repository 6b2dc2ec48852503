"""Gain and offset of views whose grey values are paired with those of the reference."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

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

    def of(self, grey: float) -> Float:
        """One grey value of every view, on the scale of the reference, (V,)."""
        return self.gain * grey + self.offset

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
    x, y = grey.astype(np.float64), np.broadcast_to(target.astype(np.float64), grey.shape)
    gains = Gains(np.ones(len(x)), middle(y, useful) - middle(x, useful))
    smallest = 1e-3 * np.std(y, axis=1, where=useful) + 1e-9
    for _ in range(_ROUNDS):
        misfit = gains.misfit(x, y)
        scale = 1.5 * middle(np.abs(misfit), useful) + smallest
        weight = useful / (1.0 + (misfit / scale[:, None]) ** 2)
        weight /= weight.sum(axis=1, keepdims=True)
        mean_x, mean_y = (weight * x).sum(axis=1), (weight * y).sum(axis=1)
        var_x = (weight * (x - mean_x[:, None]) ** 2).sum(axis=1)
        var_y = (weight * (y - mean_y[:, None]) ** 2).sum(axis=1)
        varied = (var_x > 0) & (var_y > 0)
        gain = np.ones(len(x))
        np.divide(var_y, var_x, out=gain, where=varied)
        gain = np.sqrt(gain)
        gains = Gains(gain, mean_y - gain * mean_x)
    return gains


def middle(values: NDArray[np.floating], useful: NDArray[np.bool_]) -> Float:
    """Median of the useful values of each row, (V,); of two in the middle, the larger.

    Args:
        values: (V, N), or (1, N) for all rows alike.
        useful: (V, N).
    """
    ranked = np.sort(np.where(useful, values, np.inf), axis=1)
    half = np.count_nonzero(useful, axis=1) // 2
    return np.take_along_axis(ranked, half[:, None], axis=1)[:, 0].astype(np.float64)
