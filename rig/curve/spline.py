"""A monotone spline through the measured distances."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from rig.curve.law import Floats, Law, ModelName
from rig.curve.table import EvenTable

TABLE_SIZE = 4097
"""Inverse distance is nearly straight in the slope; straight pieces between this many nodes stay
within 1e-6 of the distance."""


@dataclass(frozen=True)
class Spline(Law):
    """Piecewise cubic of inverse distance over slope, through K knots, monotone between them.

    Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 1984 (PCHIP). Inverse distance, because over
    it the physical law is straight: the spline has only what a rig adds to bend.
    """

    name: ClassVar[ModelName] = "spline"

    knots_mm: tuple[float, ...]
    """(K,) distances, rising."""
    knots_px: tuple[float, ...]
    """(K,) slopes at these distances, falling."""

    def __post_init__(self) -> None:
        falls = np.diff(self.knots_px).max(initial=-1.0) < 0
        if len(self.knots_mm) < 2 or not falls or np.diff(self.knots_mm).min() <= 0:
            msg = "knots must be two or more, distances rising and slopes falling"
            raise ValueError(msg)

    @property
    def fitted(self) -> tuple[str, ...]:
        """See `Law.fitted`: the slopes of the knots; their distances are given."""
        return tuple(f"knot_{i:03d}_px" for i in range(len(self.knots_px)))

    def depth_mm(self, slope_px: Floats) -> Floats:
        """See `Law.depth_mm`."""
        return 1 / self._inverse_distance.at(slope_px)

    def slope_px(self, distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `Law.slope_px`; beyond the end knots their slopes."""
        table = self._inverse_distance
        nodes_px = np.linspace(table.low, table.high, table.values.size)
        return np.interp(1 / distance_mm, table.values, nodes_px)

    def depth_per_slope(self, slope_px: Floats) -> Floats:
        """See `Law.depth_per_slope`."""
        return -(self.depth_mm(slope_px) ** 2) * self._rate.at(slope_px)

    def slope_gradient(self, slope_px: Floats) -> Floats:
        """See `Law.slope_gradient`.

        A knot moves the curve by its own error where it stands, and fades linearly to its
        neighbours; the small change of the cubic's bend is left out.
        """
        knots_px = np.array(self.knots_px[::-1])
        hats = [np.interp(slope_px, knots_px, one) for one in np.eye(knots_px.size)[::-1]]
        return np.stack(hats, axis=-1)

    def params(self) -> dict[str, float]:
        """See `Law.params`: `knot_000_mm`, ..., `knot_000_px`, ..."""
        mm = {f"knot_{i:03d}_mm": z for i, z in enumerate(self.knots_mm)}
        return mm | {f"knot_{i:03d}_px": m for i, m in enumerate(self.knots_px)}

    @classmethod
    def from_params(cls, params: Mapping[str, float]) -> Self:
        """See `Law.from_params`."""
        knots = range(len(params) // 2)
        names_mm = [f"knot_{i:03d}_mm" for i in knots]
        names_px = [f"knot_{i:03d}_px" for i in knots]
        if sorted(params) != sorted(names_mm + names_px):
            msg = "a spline needs knot_000_mm ... and as many knot_000_px ..."
            raise TypeError(msg)
        return cls(tuple(params[n] for n in names_mm), tuple(params[n] for n in names_px))

    @cached_property
    def _pchip(self) -> PchipInterpolator:
        return PchipInterpolator(self.knots_px[::-1], 1 / np.array(self.knots_mm[::-1]))

    @cached_property
    def _inverse_distance(self) -> EvenTable:
        return self._table(derivative=0)

    @cached_property
    def _rate(self) -> EvenTable:
        return self._table(derivative=1)

    def _table(self, derivative: int) -> EvenTable:
        low_px, high_px = self.knots_px[-1], self.knots_px[0]
        nodes_px = np.linspace(low_px, high_px, TABLE_SIZE)
        return EvenTable(low_px, high_px, np.asarray(self._pchip(nodes_px, nu=derivative)))
