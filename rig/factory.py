"""What a device itself says of its cameras, as its maker calibrated them.

A camera that knows it keeps `FactoryCalibrated` besides `rig.devices.Camera`; all others do not
have the property.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

CALIBRATION_SHA256 = "calibration_sha256"
"""Key of `Device.identity` of a device that holds a calibration of its own: tells whether it is
still the same."""

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class FactoryCamera:
    """One view, for pictures of the size that the profile asks for."""

    view: str
    width_px: int
    height_px: int
    matrix_px: Matrix
    """(3, 3) camera matrix; pixel (0, 0) is the centre of the top-left pixel."""
    distortion: tuple[float, ...]
    """OpenCV's order: k1, k2, p1, p2, k3, ...; of a fish-eye k1 to k4."""
    is_fisheye: bool
    rotation: Matrix
    """(3, 3), turns directions of this view's frame into that of the first view."""
    centre_mm: tuple[float, ...]
    """Optical centre in the frame of the first view."""


@runtime_checkable
class FactoryCalibrated(Protocol):
    """A camera that may hold its maker's calibration."""

    @property
    def factory_calibration(self) -> Sequence[FactoryCamera] | None:
        """Every view in the order of the camera's; None where the opened device holds none."""
        ...


def changed_calibration(before: Mapping[str, object], now: Mapping[str, object]) -> str | None:
    """Return the key under which two identities hold different calibrations of their devices.

    Args:
        before: identity of the camera then.
        now: identity of the camera now.

    Returns:
        None where nothing differs, or one of them does not tell it.
    """
    for key, value in before.items():
        if key.rpartition(".")[2] == CALIBRATION_SHA256 and now.get(key, value) != value:
            return key
    return None
