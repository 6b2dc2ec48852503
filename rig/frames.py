"""Images with their time: what a camera gives."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rig.scan import Scan

GreyImage = NDArray[np.uint8] | NDArray[np.uint16]
ColourImage = NDArray[np.uint8]
"""(H, W, 3) red, green and blue."""
Pictures: TypeAlias = Sequence[GreyImage] | GreyImage
"""One (H, W) picture per view, each as its camera gave it: views may differ in size. An array
(V, H, W) where all are of one size."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One image of one view; the pixels are read-only."""

    view: str
    """Name of the view, as in the profile."""
    image: GreyImage
    """(H, W) grey values, 8 or 16 bit."""
    timestamp_s: float
    """Middle of the exposure on the clock of the camera's host, s."""
    sequence: int
    """Frame counter of this view; in a stream a gap means lost frames."""
    exposure_s: float | None = None
    """Exposure as the device reports it."""
    bits: int | None = None
    """Bits of a grey value: 10 in a 16-bit image means 0..1023. None: all bits of the image."""
    uncertainty_s: float = 0.0
    """How much earlier than `timestamp_s` the middle of the exposure may have been: the driver of
    the device tells when the image was complete, but not how long that took."""
    colour: ColourImage | None = None
    """The same picture in colour, of the same read-out and pixel by pixel; None where the camera
    has none. Targets are measured in `image`."""

    def __post_init__(self) -> None:
        image = self.image.view()
        image.flags.writeable = False
        object.__setattr__(self, "image", image)
        if self.colour is not None:
            colour = self.colour.view()
            colour.flags.writeable = False
            object.__setattr__(self, "colour", colour)

    @property
    def began_s(self) -> float:
        """Earliest time at which light of this image can have been collected."""
        return self.timestamp_s - self.uncertainty_s - (self.exposure_s or 0.0) / 2.0

    @property
    def full_scale(self) -> int:
        """Grey value of a saturated pixel."""
        return (1 << (self.bits or 8 * self.image.dtype.itemsize)) - 1


@dataclass(frozen=True, slots=True)
class MultiView:
    """One frame per view, all of one instant, in the camera's fixed order."""

    frames: tuple[Frame, ...]
    temperature_degc: float | None = None
    """Temperature of the camera where the device reports one."""
    scan: "Scan | None" = None
    """What is known of the scan, where one camera moved from view to view."""

    @property
    def skew_s(self) -> float:
        """Time between the first and the last exposure among the views of one instant.

        Each take of a scan is an instant of its own, and has one view.
        """
        if self.scan is not None:
            return 0.0
        times_s = [frame.timestamp_s for frame in self.frames]
        return max(times_s) - min(times_s)

    @property
    def timestamp_s(self) -> float:
        """Mean mid-exposure time of the views."""
        return sum(frame.timestamp_s for frame in self.frames) / len(self.frames)

    @property
    def images(self) -> tuple[GreyImage, ...]:
        """The images, each of its camera's own size, in the camera's order."""
        return tuple(frame.image for frame in self.frames)
