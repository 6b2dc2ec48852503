"""What the page of a calibration is made from."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rig.frames import GreyImage
from rig.geometry.bundle.result import Calibration, Residuals

MOST_PICTURES = 3
"""How many multi-views are shown with their corners."""


@dataclass(frozen=True, slots=True)
class ShownCalibration:
    """A calibration with its pictures and what else the page tells."""

    rig: str
    calibration: Calibration
    images: Mapping[tuple[int, int], GreyImage] = field(default_factory=dict)
    """By picture and view: pictures at hand; three multi-views are enough."""
    facts: Mapping[str, object] = field(default_factory=dict)
    """Identity: date, devices, serial numbers, temperature, software."""

    @property
    def shown_pictures(self) -> tuple[int, ...]:
        """First, middle and last of the pictures whose images are at hand."""
        numbers = [n for n in self.calibration.pictures if any(p == n for p, _ in self.images)]
        if len(numbers) <= MOST_PICTURES:
            return tuple(numbers)
        places = np.rint(np.linspace(0, len(numbers) - 1, MOST_PICTURES)).astype(int)
        return tuple(numbers[i] for i in places)

    def residuals_of(self, view: int) -> list[Residuals]:
        """Residuals of all sightings of one view."""
        return [r for r in self.calibration.residuals if r.view == view]
