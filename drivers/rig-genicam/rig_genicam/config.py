"""GenICam cameras in a profile."""

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    StrictBool,
    StrictInt,
    StrictStr,
    model_validator,
)

from rig.profile import CameraConfig

FeatureValue = StrictBool | StrictInt | FiniteFloat | StrictStr
"""A switch, a number, or a text: also the name of an entry of a list."""
PictureSide = Annotated[int, Field(ge=16, le=16384)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
PixelFormat = Literal[
    "Mono8", "Mono10", "Mono12", "Mono14", "Mono16", "Mono10p", "Mono12p", "Mono10Packed",
    "Mono12Packed", "BayerRG8", "BayerGR8", "BayerGB8", "BayerBG8", "BayerRG10", "BayerGR10",
    "BayerGB10", "BayerBG10", "BayerRG12", "BayerGR12", "BayerGB12", "BayerBG12", "BayerRG16",
    "BayerGR16", "BayerGB16", "BayerBG16", "BayerRG10p", "BayerGR10p", "BayerGB10p", "BayerBG10p",
    "BayerRG12p", "BayerGR12p", "BayerGB12p", "BayerBG12p", "BayerRG12Packed", "BayerGR12Packed",
    "BayerGB12Packed", "BayerBG12Packed", "RGB8", "BGR8",
]  # fmt: skip
"""Names of the Pixel Format Naming Convention (PFNC), as the cameras' own lists have them."""


class TriggerConfig(BaseModel):
    """What starts an exposure, by the words of GenICam's naming convention (SFNC)."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    source: str
    """`Software`: rig fires all cameras at one moment, `rate_hz` times a second. An input, as
    `Line1`: pulses of a generator or of another camera, `rate_hz` of them a second."""
    activation: str | None = None
    """Which edge counts, as `RisingEdge`; None leaves it alone."""
    selector: str = "FrameStart"
    """What is triggered; `FrameStart` is one picture each."""

    @property
    def is_software(self) -> bool:
        """Whether rig fires."""
        return self.source == "Software"


class GenicamCameraConfig(CameraConfig):
    """GigE Vision and USB3 Vision cameras, one per view, all in one mode.

    What a camera does not have, refuses, or changes is an error: nothing is clipped. What it reads
    back is kept with every run. `arv-tool-0.8 values` shows what a camera has.
    """

    kind: Literal["genicam"]
    """Selects GenICam cameras."""
    devices: dict[str, str]
    """By view name: serial number, name or IPv4 address of its camera, as `rig devices` lists
    them."""
    width_px: PictureSide
    """Image width, as the cameras offer it."""
    height_px: PictureSide
    """Image height, as the cameras offer it."""
    offset_x_px: int = Field(default=0, ge=0)
    """Where the picture begins on the sensor, px from its left."""
    offset_y_px: int = Field(default=0, ge=0)
    """Where the picture begins on the sensor, px from its top."""
    rate_hz: Positive
    """Frames per second; with a trigger the rate of its pulses."""
    pixel_format: PixelFormat = "Mono8"
    """How the pixels come. Values keep the sensor's counts (10 bits: 0..1023). Bayer mosaics become
    grey as (red + 2 green + blue) / 4, RGB8 and BGR8 as 0.299 red + 0.587 green + 0.114 blue."""
    colour: bool = True
    """Whether to keep the colour picture beside the grey one that is measured, where the pixel
    format has colour; `false` spares the time of decoding it."""
    exposure_s: Positive | None = None
    """Exposure time; switches the automatism off. None leaves it alone."""
    gain: FiniteFloat | None = None
    """Gain in the camera's own unit, mostly dB; switches the automatism off. None leaves it
    alone."""
    features: dict[str, FeatureValue] = Field(default={})
    """Any other feature of all cameras by its GenICam name, set in this order; `true` executes a
    command."""
    view_features: dict[str, dict[str, FeatureValue]] = Field(default={})
    """By view name: features of that camera only, in the place of those of all or after them."""
    trigger: TriggerConfig | None = None
    """What starts every exposure; None: every camera runs freely."""

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
    def _features_belong_to_views(self) -> Self:
        unknown = sorted(set(self.view_features) - set(self.devices))
        if unknown:
            raise ValueError(f"view_features names no view: {', '.join(unknown)}")
        return self

    @model_validator(mode="after")
    def _every_view_has_a_camera_of_its_own(self) -> Self:
        shared = sorted({d for d in self.devices.values() if [*self.devices.values()].count(d) > 1})
        if shared:
            raise ValueError(f"devices names one camera for two views: {', '.join(shared)}")
        return self
