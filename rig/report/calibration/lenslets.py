"""What the page of a calibration of lenslets is made from."""

from collections.abc import Mapping
from dataclasses import dataclass

from rig.arrays import Float
from rig.lenslet.array import LensletArray
from rig.lenslet.fit import FittedLattice


@dataclass(frozen=True, slots=True, eq=False)
class ShownLenslets:
    """A calibration of lenslets with its white picture."""

    rig: str
    number: int
    """Of the calibration."""
    array: LensletArray
    fitted: FittedLattice
    white: Float
    """(H, W) grey values."""
    quality: Mapping[str, object]
    """Its numbers, by name."""
