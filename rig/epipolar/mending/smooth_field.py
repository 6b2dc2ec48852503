"""Smooth fields over a picture, fitted robustly to scattered measurements.

What cameras differ by over a picture (rows that do not meet, light) varies slowly: a polynomial of
the fourth degree, held back the more the higher its degree, so that it does not run away where
nothing was measured (ridge regression: A. E. Hoerl and R. W. Kennard, "Ridge regression: biased
estimation for nonorthogonal problems", Technometrics 12, 1970). Cauchy weights leave out wrong
measurements.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

_DEGREE = 4
_ROUNDS = 5
DOUBT = 2.4
"""Cauchy scale over the scatter of what is fitted."""
_FOLDS, _SURE = 2, 4.0
"""And how many of its own standard errors what a field gains must have."""
_CELLS, _FEWEST_IN_CELL = 4, 5
_AT_ONCE = 64
_GRID = 17


def _degrees() -> list[tuple[int, int]]:
    return [(i, n - i) for n in range(_DEGREE + 1) for i in range(n + 1)]


TERMS = len(_degrees())
HELD = np.array([0.6 ** (i + j) for i, j in _degrees()])
"""Expected size of a coefficient over that of a constant."""


@dataclass(frozen=True, slots=True)
class SmoothField:
    """A field over pictures of one size."""

    coefficients: Float
    """(TERMS,) of Legendre products."""
    shape: tuple[int, int]
    """Height and width of the pictures, px."""
    covariance: Float
    """(TERMS, TERMS)."""
    scatter: float
    """Robust standard deviation of the measurements about the field, 1 sigma."""

    def at(self, x_px: Float, y_px: Float) -> Float:
        """Values at places (N,)."""
        return basis(x_px, y_px, self.shape) @ self.coefficients

    def sigma_at(self, x_px: Float, y_px: Float) -> Float:
        """How sure the values at places (N,) are, 1 sigma."""
        design = basis(x_px, y_px, self.shape)
        return np.sqrt(np.maximum(((design @ self.covariance) * design).sum(axis=1), 0.0))

    def on_top_of(self, first: "SmoothField | None") -> "SmoothField":
        """Return the sum with a field that was taken out before this one was measured."""
        if first is None:
            return self
        return replace(self, coefficients=first.coefficients + self.coefficients)

    def everywhere(self) -> NDArray[np.float32]:
        """Value of every pixel, (H, W)."""
        return values_everywhere(self.coefficients, self.shape)


def basis(x_px: Float, y_px: Float, shape: tuple[int, int]) -> Float:
    """Legendre products at places (N,), (N, TERMS)."""
    along, down = _legendre(x_px, shape[1]), _legendre(y_px, shape[0])
    return np.stack([along[:, i] * down[:, j] for i, j in _degrees()], axis=1)


def grid_of(shape: tuple[int, int]) -> tuple[Float, Float]:
    """Columns and rows (N,) of places all over a picture."""
    height, width = shape
    columns, rows = np.meshgrid(
        np.linspace(0.0, width - 1.0, _GRID), np.linspace(0.0, height - 1.0, _GRID)
    )
    return columns.ravel(), rows.ravel()


def values_everywhere(coefficients: Float, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Value of a field with some coefficients (TERMS,) at every pixel of a picture."""
    height, width = shape
    along, down = _legendre(np.arange(width), width), _legendre(np.arange(height), height)
    table = np.zeros((_DEGREE + 1, _DEGREE + 1))
    for (i, j), coefficient in zip(_degrees(), coefficients, strict=True):
        table[j, i] = coefficient
    return (down @ table).astype(np.float32) @ along.T.astype(np.float32)


def fit_field(
    x_px: Float,
    y_px: Float,
    values: Float,
    sigmas: Float,
    shape: tuple[int, int],
    scale: float,
) -> SmoothField:
    """Fit a field to measurements (N,), each with its own sigma.

    Args:
        x_px: columns.
        y_px: rows.
        values: what was measured.
        sigmas: 1 sigma of each, up to a common factor.
        shape: height and width of the pictures.
        scale: size of a field that is believed without evidence, 1 sigma of its constant.
    """
    design = basis(x_px, y_px, shape)
    prior = np.diag(1.0 / (scale * HELD) ** 2)
    weight = 1.0 / np.maximum(sigmas, 1e-9) ** 2
    found = np.zeros(TERMS)
    found[0] = float(np.median(values)) if len(values) else 0.0
    covariance, spread = np.linalg.inv(prior), 1.0
    for _ in range(_ROUNDS):
        rest = (values - design @ found) * np.sqrt(weight)
        spread = 1.4826 * float(np.median(np.abs(rest))) if len(rest) else 1.0
        spread = max(spread, 1e-6)
        held = weight / (1.0 + (rest / (DOUBT * spread)) ** 2) / spread**2
        normal, right = normal_equations(design, held, values)
        covariance = np.linalg.inv(normal + prior)
        found = covariance @ right
    middle = float(np.median(np.maximum(sigmas, 1e-9))) if len(sigmas) else 0.0
    return SmoothField(found, shape, np.asarray(covariance, np.float64), spread * middle)


def coarse_rms(x_px: Float, y_px: Float, values: Float, shape: tuple[int, int]) -> float:
    """Size of what varies over the picture, at a glance: rms of the medians of its cells.

    Args:
        x_px: columns, (N,).
        y_px: rows, (N,).
        values: (N,).
        shape: height and width of the pictures.
    """
    column = np.clip((_CELLS * x_px / shape[1]).astype(int), 0, _CELLS - 1)
    row = np.clip((_CELLS * y_px / shape[0]).astype(int), 0, _CELLS - 1)
    cell = row * _CELLS + column
    ranked = values[np.lexsort((values, cell))]  # cell by cell, each from low to high
    counts = np.bincount(cell, minlength=_CELLS**2)
    starts = np.cumsum(counts) - counts
    enough = counts >= _FEWEST_IN_CELL
    if not enough.any():
        return 0.0
    low, high = (starts + (counts - 1) // 2)[enough], (starts + counts // 2)[enough]
    medians = 0.5 * (ranked[low] + ranked[high])
    return float(np.sqrt(np.mean(np.square(medians))))


def normal_equations(design: Float, weight: Float, values: Float) -> tuple[Float, Float]:
    """Weighted normal matrix and right side of a design (N, A) and values (N,).

    In small parts, for which the linear algebra library starts no threads: they would wait for
    cores that others use, and add up in an order of their own.
    """
    normal, right = np.zeros((design.shape[1],) * 2), np.zeros(design.shape[1])
    weighted = design * weight[:, None]
    for start in range(0, len(design), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        normal += weighted[part].T @ design[part]
        right += weighted[part].T @ values[part]
    return normal, right


def is_worth_it(
    x_px: Float,
    y_px: Float,
    values: Float,
    sigmas: Float,
    shape: tuple[int, int],
    scale: float,
) -> bool:
    """Whether a field fitted to one half of the measurements brings the other half nearer to zero.

    Args:
        x_px: columns, (N,).
        y_px: rows, (N,).
        values: what was measured, (N,).
        sigmas: 1 sigma of each, (N,).
        shape: height and width of the pictures.
        scale: as `fit_field` takes it.
    """
    fold = np.arange(len(values)) % _FOLDS
    gains: list[Float] = []
    for k in range(_FOLDS):
        own, other = fold != k, fold == k
        field = fit_field(x_px[own], y_px[own], values[own], sigmas[own], shape, scale)
        doubt = DOUBT * max(field.scatter, 1e-9)
        before, after = values[other], values[other] - field.at(x_px[other], y_px[other])
        gains.append(robust_gain(before, after, doubt))
    return len(values) > TERMS and is_sure(np.concatenate(gains))


def robust_gain(before: Float, after: Float, scale: float) -> Float:
    """Fall of the Cauchy loss of measurements (N,) of a scale, by what a field explains."""
    return np.log1p((before / scale) ** 2) - np.log1p((after / scale) ** 2)


def is_sure(gain: Float) -> bool:
    """Whether the mean of gains (N,) stands out of its own standard error."""
    error = float(gain.std()) / max(len(gain), 1) ** 0.5
    return float(gain.mean()) > _SURE * error


def _legendre(places_px: NDArray[np.number], size_px: int) -> Float:
    """(N, degrees + 1) at places of an axis that runs from -1 to 1 over the picture."""
    t = 2.0 * np.asarray(places_px, np.float64) / max(size_px - 1, 1) - 1.0
    return np.asarray(np.polynomial.legendre.legvander(t, _DEGREE), np.float64)
