"""A camera behind a lenslet array, around any camera that gives its raw pictures."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field

from rig.profile.by_kind import InnerCameraSection
from rig.profile.cameras import CameraConfig
from rig.profile.model import NotNegative, Positive
from rig.profile.views import ViewConfig

RAW_VIEW = ViewConfig(name="raw", x_steps=0.0, y_steps=0.0)
"""The one view of the camera inside."""


class LensletCameraConfig(CameraConfig):
    """A light-field camera: the views of the profile lie inside the micro-images of its lenslets.

    A view at (x_steps, y_steps) sees through the part of the main lens that is `pitch_mm` times as
    far to the right and down; raw pictures are upright.
    """

    path_keys: ClassVar[tuple[str, ...]] = ("white", "dark")

    kind: Literal["lenslet"]
    """Selects a lenslet camera."""
    lattice: Literal["hexagonal", "square"]
    """How the lenslets are arranged."""
    spacing_px: float = Field(ge=5.0)
    """Between neighbouring micro-images in the raw picture, to 10 %."""
    step_px: Positive
    """From view to view inside a micro-image, px of the raw picture per view step."""
    is_bayer: bool = False
    """Whether neighbouring pixels have filters of other colours, in blocks of 2 x 2."""
    bits: int | None = Field(default=None, ge=8, le=16)
    """Bits of a grey value; None: as the raw pictures say it."""
    dark_levels: NotNegative = 0.0
    """Grey value without light, where there is no dark picture."""
    white: str | None = None
    """Picture of an evenly lit white surface for `rig calibrate`; None takes it with the camera."""
    dark: str | None = None
    """Picture without light; it is taken from every raw picture."""
    raw: InnerCameraSection
    """Where raw pictures come from: any camera of one view, which is called `raw`."""
    lenslets: dict[str, Any] | None = Field(default=None, exclude=True)
    """The calibrated array. Runs put it here, from the calibration that they use."""

    @property
    def is_stored(self) -> bool:
        """See `CameraConfig.is_stored`."""
        return self.raw.is_stored

    @property
    def is_simulated(self) -> bool:
        """See `CameraConfig.is_simulated`."""
        return self.raw.is_simulated

    @property
    def needs_real_time(self) -> bool:
        """See `CameraConfig.needs_real_time`."""
        return self.raw.needs_real_time

    @property
    def by_view(self) -> Mapping[str, Mapping[str, object]]:
        """See `CameraConfig.by_view`; the camera inside has its own one view."""
        return {}

    @property
    def asked_rate_hz(self) -> float | None:
        """See `CameraConfig.asked_rate_hz`."""
        return self.raw.asked_rate_hz

    @property
    def typical_grab_s(self) -> float:
        """See `CameraConfig.typical_grab_s`."""
        return self.raw.typical_grab_s
