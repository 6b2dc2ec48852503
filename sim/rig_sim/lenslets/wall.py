"""A wall square to the axis, painted with waves: all a lenslet camera sees of it is known."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Wall:
    """A sum of plane waves around half of the light."""

    distance_mm: float
    per_mm: Array
    """(N, 2) periods per mm, to the right and down."""
    phase_rad: Array
    """(N,)."""
    height: float
    """Of each wave, 1 = full light."""

    @classmethod
    def random(cls, distance_mm: float, finest_per_mm: float, share: float, seed: int) -> "Wall":
        """Return waves of all directions, evenly spread over all frequencies up to the finest.

        Args:
            distance_mm: along the axis.
            finest_per_mm: highest frequency.
            share: standard deviation of the light, of full light.
            seed: of frequencies and phases.
        """
        generator, count = np.random.default_rng(seed), 60
        frequency = finest_per_mm * np.sqrt(generator.random(count))
        angle = 2.0 * math.pi * generator.random(count)
        waves = frequency[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        phase = 2.0 * math.pi * generator.random(count)
        return cls(distance_mm, waves, phase, share * math.sqrt(2.0 / count))

    def light(self, x_mm: Array, y_mm: Array, sigma_mm: float) -> Array:
        """Return the light of places of the wall, blurred by a Gaussian."""
        light = np.full(x_mm.shape, 0.5)
        for (across, down), phase in zip(self.per_mm, self.phase_rad, strict=True):
            kept = math.exp(-2.0 * (math.pi * sigma_mm) ** 2 * float(across**2 + down**2))
            turns = 2.0 * math.pi * (across * x_mm + down * y_mm)
            light += self.height * kept * np.cos(turns + phase)
        return np.clip(light, 0.0, 1.0)
