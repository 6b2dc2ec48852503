"""V4L2 cameras in a profile."""

from collections.abc import Mapping
from typing import Literal, Self

from pydantic import Field, model_validator

from rig.profile.cameras import CameraConfig
from rig.profile.model import Positive
from rig.profile.parts import IN_TURN, PartConfig, Region, by_source, regions_in, require_parts

ControlValue = bool | int | str
"""A switch, a number, or the name of a menu entry."""


# fmt: off
V4l2PixelFormat = Literal[
    "GREY", "Y10", "Y12", "Y14", "Y16", "Y10P", "Y12P", "YUYV", "YVYU", "UYVY", "VYUY",
    "NV12", "NV21", "NV16", "NV61", "YU12", "YV12", "MJPG", "JPEG", "RGB3", "BGR3",
    "BA81", "GBRG", "GRBG", "RGGB", "BG10", "GB10", "BA10", "RG10", "BG12", "GB12", "BA12", "RG12",
    "BG14", "GB14", "GR14", "RG14", "BYR2", "GB16", "GR16", "RG16",
    "pBAA", "pGAA", "pgAA", "pRAA", "pBCC", "pGCC", "pgCC", "pRCC", "Y8I", "Y12I",
]
# fmt: on
"""The kernel's four letters."""


class V4l2CameraConfig(CameraConfig):
    """V4L2 cameras (USB, CSI) in one mode, one per view or with several views in one picture.

    What a device does not offer, refuses, or changes is an error: nothing is clipped. What it reads
    back is kept with every run. `v4l2-ctl --list-formats-ext --list-ctrls` shows what a device has.
    """

    kind: Literal["v4l2"]
    """Selects V4L2 cameras."""
    devices: dict[str, str]
    """By view name: the path of its device, best in `/dev/v4l/by-path/` (named by the USB socket)
    or `/dev/v4l/by-id/` (named by the serial number): `/dev/video0` changes between starts. Views
    of one picture name the same device, and their `parts`."""
    parts: dict[str, PartConfig] = Field(default={})
    """By view name: which part of the device's picture it is, as `"side-by-side:1"`; a view
    without a part is the whole picture."""
    width_px: int = Field(ge=16, le=16384)
    """Image width, as the devices offer it."""
    height_px: int = Field(ge=16, le=16384)
    """Image height, as the devices offer it."""
    rate_hz: Positive
    """Frames per second, as the devices offer it (within 0.5 %: 30 takes 29.97)."""
    pixel_format: V4l2PixelFormat
    """How the pixels come. Grey formats are best; of YUYV, NV12 and the like the luma is taken;
    MJPG loses detail and is last. 10 to 16 bits keep the sensor's counts (0..1023, 0..4095 ...),
    packed (P) or not. Bayer mosaics (RGGB, RG10, pRAA ...) become grey as
    (red + 2 green + blue) / 4, RGB3 and BGR3 as 0.299 red + 0.587 green + 0.114 blue. Y8I and Y12I
    hold the pixels of two views in turn: their `parts` are `interleaved`."""
    colour: bool = True
    """Whether to keep the colour picture beside the grey one that is measured, where the pixel
    format has colour; `false` spares the time of decoding it."""
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
        regions = self.regions.values()
        return next((r.size_px for r in regions), (self.width_px, self.height_px))

    def size_of(self, view: str) -> tuple[int, int]:
        """See `CameraConfig.size_of`."""
        region = self.regions.get(view)
        return self.picture_px if region is None else region.size_px

    @property
    def asked_rate_hz(self) -> float:
        """See `CameraConfig.asked_rate_hz`."""
        return self.rate_hz

    @property
    def is_one_picture(self) -> bool:
        """See `CameraConfig.is_one_picture`."""
        return len(self.devices) > 1 and len(self.by_device) == 1

    @property
    def by_device(self) -> dict[str, tuple[str, ...]]:
        """By path of a device: its views."""
        return by_source(self.devices)

    @property
    def picture_px(self) -> tuple[int, int]:
        """Width and height of what a device gives at a time, all its views together."""
        return (2 if self.pixel_format in IN_TURN else 1) * self.width_px, self.height_px

    @property
    def regions(self) -> dict[str, Region]:
        """By view: its pixels in its device's picture, where it is not the whole one."""
        found: dict[str, Region] = {}
        for views in self.by_device.values():
            parts = {view: self.parts[view] for view in views if view in self.parts}
            found |= regions_in(parts, self.picture_px)
        return found

    def controls_of(self, view: str) -> dict[str, ControlValue]:
        """Return the controls that the device of a view has for itself."""
        own: dict[str, ControlValue] = {}
        for other in self.by_device[self.devices[view]]:
            own |= self.view_controls.get(other, {})
        return own

    @model_validator(mode="after")
    def _controls_belong_to_views(self) -> Self:
        unknown = sorted(set(self.view_controls) - set(self.devices))
        if unknown:
            raise ValueError(f"view_controls names no view: {', '.join(unknown)}")
        return self

    @model_validator(mode="after")
    def _parts_are_views(self) -> Self:
        require_parts(self.devices, self.parts, "devices")
        if self.pixel_format in IN_TURN:
            odd = [v for v in self.devices if v not in self.parts or not self.parts[v].is_in_turn]
            if odd:
                raise ValueError(
                    f"{self.pixel_format} holds the pixels of two views in turn; give parts of the "
                    f'layout interleaved for {", ".join(odd)}, as "interleaved:1"'
                )
        _ = self.regions  # raises where a part is not inside its picture
        return self

    @model_validator(mode="after")
    def _devices_are_told_one_thing(self) -> Self:
        for device, views in self.by_device.items():
            told: dict[str, ControlValue] = {}
            for name, value in (c for v in views for c in self.view_controls.get(v, {}).items()):
                if told.setdefault(name, value) != value:
                    raise ValueError(
                        f"view_controls.{name} is {told[name]} and {value} for views of one "
                        f"device, {device}; give it once"
                    )
        return self
