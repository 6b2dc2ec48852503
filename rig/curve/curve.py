"""The depth-slope curve of one rig: a fitted law with its limits and its uncertainty."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from rig.curve.field import FieldTerm
from rig.curve.law import Floats, Law, ModelName
from rig.curve.least_squares import FittedLaw
from rig.curve.physical import Physical, PhysicalCurved
from rig.curve.spline import Spline
from rig.curve.table import EvenTable
from rig.curve.two_lines import TwoLines
from rig.errors import CurveError
from rig.json_codec import Codec

LAWS: tuple[type[Law], ...] = (Physical, PhysicalCurved, TwoLines, Spline)
SIGMA_TABLE_SIZE = 513


@dataclass(frozen=True)
class Curve:
    """Turns slopes into depths between the distances that were measured, and nowhere else.

    Depth is measured from the reference camera's optical centre along +z.

    Raises:
        CurveError: the parts do not make one falling curve.
    """

    law: Law
    covariance: tuple[tuple[float, ...], ...]
    """(P, P) of the parameters `law.fitted`, in their units."""
    valid_mm: tuple[float, float]
    """Nearest and farthest distance of the fit."""
    scatter_px: float
    """Standard deviation of a stop's slope beyond what its samples show."""
    field: FieldTerm | None = None
    """What a slope changes over the picture; None where the sweep shows nothing."""

    def __post_init__(self) -> None:
        near_mm, far_mm = self.valid_mm
        count = len(self.law.fitted)
        widths = sorted({len(row) for row in self.covariance})
        square = widths == [count] and len(self.covariance) == count
        covariance = np.array(self.covariance if square else np.nan)
        if not 0 < near_mm < far_mm < np.inf:
            raise CurveError(
                f"a curve valid for {near_mm}..{far_mm} mm has no range", advice="fit it again"
            )
        if not np.isfinite(covariance).all():
            shape = f"({len(self.covariance)}, {' or '.join(map(str, widths))})"
            raise CurveError(
                f"the {self.model} curve has {count} fitted parameters and a covariance of shape "
                f"{shape}",
                advice=f"it must be finite and ({count}, {count}): fit it again",
            )
        if np.any(np.diag(covariance) < 0) or not 0 <= self.scatter_px < np.inf:
            raise CurveError(
                f"the {self.model} curve has a negative variance", advice="fit it again"
            )
        with np.errstate(all="ignore"):
            slopes_px = self.law.slope_px(np.linspace(near_mm, far_mm, SIGMA_TABLE_SIZE))
        if not (np.isfinite(slopes_px).all() and np.all(np.diff(slopes_px) < 0)):
            raise CurveError(
                f"the {self.model} curve does not fall from {near_mm:.1f} to {far_mm:.1f} mm",
                advice="nearer must give a larger slope",
            )

    @classmethod
    def of(cls, fitted: FittedLaw[Law]) -> Self:
        """Put limits around a fitted law."""
        covariance = tuple(tuple(row) for row in fitted.covariance.tolist())
        return cls(fitted.law, covariance, fitted.valid_mm, fitted.scatter_px)

    @property
    def model(self) -> ModelName:
        """Name of the law."""
        return self.law.name

    @property
    def params(self) -> dict[str, float]:
        """Every parameter of the law, its unit in its name."""
        return self.law.params()

    @cached_property
    def domain_px(self) -> tuple[float, float]:
        """Lowest (farthest) and highest (nearest) slope that has a depth."""
        far_px, near_px = self.law.slope_px(np.array(self.valid_mm[::-1])).tolist()
        return far_px, near_px

    @property
    def focus_mm(self) -> float | None:
        """Distance where the slope is 0, or None where that lies outside `valid_mm`."""
        focus_mm = float(self.depth_mm(np.zeros(1))[0])
        return focus_mm if isfinite(focus_mm) else None

    @property
    def focus_sigma_mm(self) -> float | None:
        """1 sigma of `focus_mm` from the covariance of the parameters."""
        sigma_mm = float(self.depth_sigma_mm(np.zeros(1), np.zeros(1))[0])
        return sigma_mm if isfinite(sigma_mm) else None

    def depth_mm(self, slope_px: Floats) -> Floats:
        """Turn slopes into depths.

        Args:
            slope_px: Any shape, float32 or float64; px per view step.

        Returns:
            Depth of the same shape and type; NaN outside `domain_px` and where the slope is NaN.
        """
        return self.law.depth_mm(self._inside(slope_px))

    def depth_sigma_mm(self, slope_px: Floats, sigma_px: Floats) -> Floats:
        """Standard deviation of depth from that of the slope and that of the curve.

        Both are variances of the slope at one depth, so they add, and `|dZ/dm|` carries the sum to
        depth (first-order propagation, JCGM 100:2008, 5.1.2). The scatter between stops is not
        added: it is the sweep's noise and reaches depth through the covariance.

        Args:
            slope_px: Any shape, float32 or float64.
            sigma_px: 1 sigma of each slope, same shape.

        Returns:
            1 sigma, mm; NaN where `depth_mm` is NaN or the slope's sigma is.
        """
        inside_px = self._inside(slope_px)
        variance_px2 = sigma_px**2 + self._curve_sigma_px.at(inside_px) ** 2
        return np.sqrt(variance_px2) * -self.law.depth_per_slope(inside_px)

    def without_field(self, slope_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Slopes (H, W) of the reference view with the field term taken out of them.

        Every other method is about such slopes.
        """
        if self.field is None:
            return slope_px
        added_px, _ = self.field.maps((slope_px.shape[0], slope_px.shape[1]))
        return slope_px - added_px

    def slope_px(self, distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Slope at distances of any shape; NaN outside `valid_mm`."""
        near_mm, far_mm = self.valid_mm
        inside = (distance_mm >= near_mm) & (distance_mm <= far_mm)
        slope_px = np.full(distance_mm.shape, np.nan)
        slope_px[inside] = self.law.slope_px(distance_mm[inside])
        return slope_px

    def curve_sigma_px(self, distance_mm: NDArray[np.float64]) -> Floats:
        """1 sigma of the curve itself at distances of any shape; NaN outside `valid_mm`."""
        return self._curve_sigma_px.at(self.slope_px(distance_mm))

    def to_json(self) -> dict[str, Any]:
        """A plain dict of numbers, strings and lists; `from_json` gives back an equal curve."""
        content = _JSON.to_json(
            _StoredCurve(
                self.model, self.params, self.covariance, self.valid_mm, self.scatter_px, self.field
            )
        )
        # Curves without a field term are written as they were before there was one.
        return {name: value for name, value in content.items() if value is not None}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Self:
        """Build the curve that `to_json` wrote.

        Raises:
            CurveError: unknown or missing names, other types, or numbers that make no curve.
        """
        stored = _JSON.from_json(dict(content))
        kinds = {law.name: law for law in LAWS}
        try:
            law = kinds[stored.model].from_params(stored.params)
        except (TypeError, ValueError) as error:
            raise CurveError(
                f"a stored {stored.model} curve is ill-formed ({error})",
                advice="run rig fit on its sweep",
            ) from error
        return cls(law, stored.covariance, stored.valid_mm, stored.scatter_px, stored.field)

    @cached_property
    def _curve_sigma_px(self) -> EvenTable:
        low_px, high_px = self.domain_px
        gradient = self.law.slope_gradient(np.linspace(low_px, high_px, SIGMA_TABLE_SIZE))
        variance_px2 = np.einsum("np,pq,nq->n", gradient, np.array(self.covariance), gradient)
        return EvenTable(low_px, high_px, np.sqrt(np.maximum(variance_px2, 0)))

    def _inside(self, slope_px: Floats) -> Floats:
        low_px, high_px = self.domain_px
        known = (slope_px >= low_px) & (slope_px <= high_px)
        return np.where(known, slope_px, slope_px.dtype.type(np.nan))


@dataclass(frozen=True, slots=True)
class _StoredCurve:
    """The fields of a curve's JSON."""

    model: ModelName
    params: dict[str, float]
    covariance: tuple[tuple[float, ...], ...]
    valid_mm: tuple[float, float]
    scatter_px: float
    field: FieldTerm | None = None


_JSON = Codec(_StoredCurve, name="curve", error=CurveError, advice="run rig fit on its sweep")
