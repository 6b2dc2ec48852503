"""What every depth-slope law can do, whatever its formula."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

ModelName = Literal["physical", "two-lines", "physical-curved", "spline"]

Floats = NDArray[np.floating[Any]]
"""float32 or float64; the answer has the type of the question."""


@dataclass(frozen=True)
class Law(ABC):
    """A strictly falling relation between distance and slope.

    A law answers everywhere and may be nonsense outside the distances it was fitted to;
    `Curve` puts the limits around it.
    """

    name: ClassVar[ModelName]

    @property
    @abstractmethod
    def fitted(self) -> tuple[str, ...]:
        """Names of the P parameters that the fit determines, in the order of its covariance."""

    @abstractmethod
    def depth_mm(self, slope_px: Floats) -> Floats:
        """Distance of every slope, mm; NaN stays NaN; any shape."""

    @abstractmethod
    def slope_px(self, distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Slope at every distance, px per view step; any shape."""

    @abstractmethod
    def depth_per_slope(self, slope_px: Floats) -> Floats:
        """Derivative dZ/dm, mm per px; negative; any shape."""

    @abstractmethod
    def slope_gradient(self, slope_px: Floats) -> Floats:
        """Change of the slope at a fixed distance with each fitted parameter: (N,) -> (N, P)."""

    def params(self) -> dict[str, float]:
        """Every parameter, its unit in its name."""
        return asdict(self)

    @classmethod
    def from_params(cls, params: Mapping[str, float]) -> Self:
        """Build the law that `params()` came from.

        Raises:
            TypeError: the names are not those of this law.
        """
        return cls(**params)

    def with_fitted(self, values: NDArray[np.float64]) -> Self:
        """Return the same law with other fitted parameters: (P,)."""
        return replace(self, **dict(zip(self.fitted, values.tolist(), strict=True)))

    def fitted_values(self) -> NDArray[np.float64]:
        """The fitted parameters as an array: (P,)."""
        params = self.params()
        return np.array([params[name] for name in self.fitted])
