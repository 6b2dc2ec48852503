"""What the driver asks of a library that speaks GenICam, in values; no library is named here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig_genicam.config import FeatureValue


class RefusedError(ValueError):
    """The camera or the library refuses a value, or has no such feature; says why."""


@dataclass(frozen=True, slots=True)
class Offer:
    """One camera that is there."""

    serial: str
    name: str
    """By which the library opens it."""
    vendor: str = ""
    model: str = ""
    address: str = ""
    """IPv4 address; empty on USB."""
    protocol: str = ""


@dataclass(frozen=True, slots=True)
class Buffer:
    """What one picture came as."""

    data: NDArray[np.uint8]
    """Bytes of the picture, its own."""
    width_px: int
    height_px: int
    pixel_bits: int
    """Bits that a pixel takes in memory."""
    frame_id: int
    """As the camera counts; GigE Vision counts 1..65535 and from 1 again."""
    device_ns: int
    """Time on the clock of the camera; 0 where it has none."""
    arrived_s: float
    """When its first bytes came, on CLOCK_MONOTONIC."""
    trouble: str = ""
    """What is wrong with it; empty: it is complete."""
    padding_bytes: int = 0
    """Behind every line."""
    chunks: Mapping[str, float] = field(default_factory=dict[str, float])
    """What the camera sent along, by the names of `CHUNKS`."""


BUFFERS = 8
"""Of each camera: one being filled, the others in reserve against a late reader."""
CHUNKS = ("Timestamp", "FrameID", "ExposureTime")
"""What is asked for, by the names of the naming convention: ns, a count, and us."""


@dataclass(frozen=True, slots=True)
class Packets:
    """What the network did, since the stream was opened; all 0 on USB."""

    received: int = 0
    missing: int = 0
    """Never came, though asked for again."""
    resent: int = 0
    """Came when they were asked for again."""


class GenicamDevice(Protocol):
    """One camera, open."""

    @property
    def name(self) -> str:
        """For messages."""
        ...

    def has(self, feature: str) -> bool:
        """Whether it has a feature, and it can be used now."""
        ...

    def read(self, feature: str) -> FeatureValue:
        """Return the value of a feature."""
        ...

    def write(self, feature: str, value: FeatureValue) -> None:
        """Set a feature; a command is executed.

        Raises:
            RefusedError: the camera or the library refuses.
            DeviceLostError: the camera is gone.
        """
        ...

    def is_command(self, feature: str) -> bool:
        """Whether a feature is something that it does, not something that it keeps."""
        ...

    def bounds(self, feature: str) -> tuple[float, float, float] | None:
        """Return least, most and step of a number, as it is now; None where it is none."""
        ...

    def entries(self, feature: str) -> Sequence[str] | None:
        """Return the entries of a list that can be chosen now; None where it is no list."""
        ...

    def open_stream(self) -> None:
        """Give it buffers for the pictures that it is set to.

        Raises:
            DeviceLostError: there is no stream to be had.
        """
        ...

    def start(self) -> None:
        """Start the pictures."""
        ...

    def next(self, timeout_s: float) -> Buffer | None:
        """Return the oldest buffer that waits; None where none came in time.

        Raises:
            DeviceLostError: the camera is gone.
        """
        ...

    def require_there(self) -> None:
        """Ask the camera for a sign of life.

        Raises:
            DeviceLostError: it gives none.
        """
        ...

    @property
    def packets(self) -> Packets:
        """What the network did."""
        ...

    def close(self) -> None:
        """Stop the pictures and let the camera go; a second time does nothing."""
        ...


class GenicamLibrary(Protocol):
    """Finds and opens cameras."""

    def offers(self) -> Sequence[Offer]:
        """Return the cameras that are there."""
        ...

    def open(self, name: str) -> GenicamDevice:
        """Open the camera with a name of `Offer.name`, or with an address.

        Raises:
            DeviceNotFoundError: it is not there, or another program has it.
        """
        ...
