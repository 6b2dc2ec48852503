"""V4L2 cameras in a profile."""

from collections.abc import Mapping
from typing import Literal, Self

from pydantic import Field, model_validator

from rig.profile.cameras import CameraConfig
from rig.profile.model import Positive

ControlValue = bool | int | str
"""A switch, a number, or the name of a menu entry."""


# fmt: off
V4l2PixelFormat = Literal[
    "GREY", "Y10", "Y12", "Y16", "Y10P", "Y12P", "YUYV", "UYVY", "NV12", "MJPG",
    "BA81", "GBRG", "GRBG", "RGGB", "BG10", "GB10", "BA10", "RG10", "BG12", "GB12", "BA12", "RG12",
    "pBAA", "pGAA", "pgAA", "pRAA", "pBCC", "pGCC", "pgCC", "pRCC",
]
# fmt: on
"""The kernel's four letters."""


class V4l2CameraConfig(CameraConfig):
    """Several V4L2 cameras (USB, CSI), one per view, all in one mode.

    What a device does not offer, refuses, or changes is an error: nothing is clipped. What it reads
    back is kept with every run. `v4l2-ctl --list-formats-ext --list-ctrls` shows what a device has.
    """

    kind: Literal["v4l2"]
    """Selects V4L2 cameras."""
    devices: dict[str, str]
    """By view name: the path of its device, best in `/dev/v4l/by-path/` (named by the USB socket)
    or `/dev/v4l/by-id/` (named by the serial number): `/dev/video0` changes between starts."""
    width_px: int = Field(ge=16, le=16384)
    """Image width, as the devices offer it."""
    height_px: int = Field(ge=16, le=16384)
    """Image height, as the devices offer it."""
    rate_hz: Positive
    """Frames per second, as the devices offer it (within 0.5 %: 30 takes 29.97)."""
    pixel_format: V4l2PixelFormat
    """How the pixels come. Grey formats are best; of YUYV, UYVY and NV12 the luma is taken; MJPG
    loses detail and is last. 10 and 12 bits keep the sensor's counts (0..1023, 0..4095), packed (P)
    or not. Bayer mosaics (RGGB, RG10, pRAA ...) become grey as (red + 2 green + blue) / 4."""
    exposure_s: Positive | None = None
    """Exposure time; switches the automatism off. Steps of 0.0001 s. None leaves it alone, and
    the middle of the exposure is then known less well."""
    gain: int | None = None
    """Gain in the device's own unit; switches the automatism off. None leaves it alone."""
    focus: int | None = None
    """Focus in the device's own unit; switches autofocus off. None leaves it alone."""
    white_balance_k: int | None = Field(default=None, gt=0)
    """White balance as a colour temperature in kelvin; switches the automatism off."""
    controls: dict[str, ControlValue] = Field(default={})
    """Any other control of all devices by the name that `v4l2-ctl` shows, set in this order."""
    view_controls: dict[str, dict[str, ControlValue]] = Field(default={})
    """By view name: controls of that device only, set after `controls`."""
    trigger: dict[str, ControlValue] = Field(default={})
    """Controls that make the devices wait for trigger pulses on their hardware input, for example
    `{trigger_mode = 1}`; set last. Empty: every device runs freely."""

    @property
    def by_view(self) -> Mapping[str, Mapping[str, object]]:
        """See `CameraConfig.by_view`."""
        return {"devices": self.devices}

    @property
    def size_px(self) -> tuple[int, int]:
        """See `CameraConfig.size_px`."""
        return self.width_px, self.height_px

    @property
    def asked_rate_hz(self) -> float:
        """See `CameraConfig.asked_rate_hz`."""
        return self.rate_hz

    @model_validator(mode="after")
    def _controls_belong_to_views(self) -> Self:
        unknown = sorted(set(self.view_controls) - set(self.devices))
        if unknown:
            raise ValueError(f"view_controls names no view: {', '.join(unknown)}")
        paths = list(self.devices.values())
        twice = sorted({path for path in paths if paths.count(path) > 1})
        if twice:
            raise ValueError(f"devices names one device for two views: {', '.join(twice)}")
        return self
