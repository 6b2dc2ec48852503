"""Cameras in a profile: one closed model per kind, told apart by `kind`."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from rig.profile.model import Model, NotNegative, Positive


class NoiseConfig(Model):
    """Noise of the pictures by photon transfer, as `rig check` prints it.

    Levels are those of the pictures, at the gain of this profile.
    """

    read_noise_levels: NotNegative
    """Noise at grey level 0 without rounding, 1 sigma."""
    electrons_per_level: Positive
    """Conversion gain: the variance of a pixel grows by grey value / `electrons_per_level`."""


class CameraConfig(Model):
    """What every kind of camera has, and what a run may ask of it without knowing the kind."""

    path_keys: ClassVar[tuple[str, ...]] = ()
    """Keys whose relative paths start at the profile file."""

    kind: Any
    """Selects the kind; every kind narrows it to a literal of its own."""
    timeout_s: Positive = 3.0
    """Longest wait for one multi-view."""
    max_skew_s: Positive = 0.005
    """Largest time between the exposures of one multi-view; anything above is dropped."""
    reconnect_s: NotNegative = 0.0
    """How long a capture looks for a device that goes away; 0 ends the capture with an error."""
    noise: NoiseConfig | None = None
    """Measured noise, by which pixels are weighed; without it the pictures themselves tell it."""

    @property
    def is_stored(self) -> bool:
        """Whether the pictures are there already, each to be had once."""
        return False

    @property
    def is_simulated(self) -> bool:
        """Whether it looks at the profile's `world`."""
        return False

    @property
    def needs_real_time(self) -> bool:
        """Whether a simulated world must run in real time for it."""
        return False

    @property
    def by_view(self) -> Mapping[str, Mapping[str, object]]:
        """By key: the tables of this section whose keys are view names."""
        return {}

    @property
    def size_px(self) -> tuple[int, int] | None:
        """Width and height of its pictures; None where the profile does not say it."""
        return None

    @property
    def asked_rate_hz(self) -> float | None:
        """Multi-views per second that the profile asks for; None where there is no such rate."""
        return None

    @property
    def typical_grab_s(self) -> float:
        """Waiting for a frame, exposing and reading it out; only for estimates of time."""
        return 0.1


class SimCameraConfig(CameraConfig):
    """The simulated camera; it looks at the profile's `world`."""

    kind: Literal["sim"]
    """Selects the simulated camera."""
    width_px: int = Field(ge=16)
    """Image width."""
    height_px: int = Field(ge=16)
    """Image height."""
    exposure_s: Positive = 0.008
    """Exposure time of every view."""
    frame_interval_s: Positive = 1.0 / 30.0
    """Time between frames."""

    @property
    def is_simulated(self) -> bool:
        """See `CameraConfig.is_simulated`."""
        return True

    @property
    def size_px(self) -> tuple[int, int]:
        """See `CameraConfig.size_px`."""
        return self.width_px, self.height_px

    @property
    def asked_rate_hz(self) -> float:
        """See `CameraConfig.asked_rate_hz`."""
        return 1.0 / self.frame_interval_s

    @property
    def typical_grab_s(self) -> float:
        """See `CameraConfig.typical_grab_s`."""
        return self.frame_interval_s + self.exposure_s


class FolderCameraConfig(CameraConfig):
    """Stored images instead of a device."""

    path_keys: ClassVar[tuple[str, ...]] = ("folder",)

    kind: Literal["folder"]
    """Selects stored images."""
    folder: str
    """Folder with the images; relative paths start at the profile file."""
    files: dict[str, str]
    """By view name: a file name or pattern (`left_*.png`), one match per multi-view, in order; or
    a video, which holds them all."""

    @property
    def is_stored(self) -> bool:
        """See `CameraConfig.is_stored`."""
        return True

    @property
    def by_view(self) -> Mapping[str, Mapping[str, object]]:
        """See `CameraConfig.by_view`."""
        return {"files": self.files}


class OakCameraConfig(CameraConfig):
    """Luxonis OAK cameras over DepthAI v3: any set of board sockets of one or several devices."""

    kind: Literal["oak"]
    """Selects OAK cameras."""
    device: str = ""
    """Device id or IP address; empty takes the only one there is. `sim://oak` runs the same
    pipeline without a device, its sensors looking at the profile's `world`."""
    sockets: dict[str, Annotated[str, Field(pattern=r"^([^/\s]+/)?CAM_[A-J]$")]]
    """By view name: the board socket of its sensor, as `CAM_B`. Where a rig has several devices,
    `DEVICE/CAM_B` names the one that is not `device`."""
    width_px: int = Field(ge=16)
    """Image width."""
    height_px: int = Field(ge=16)
    """Image height."""
    pixels: Literal["gray8", "raw10"] = "gray8"
    """`gray8`: 8 bit through the image processor; `raw10`: 10 bit as the sensor gives them, for
    monochrome sensors."""
    rate_hz: Positive = 10.0
    """Multi-views per second; a low rate saves bandwidth and keeps the sensors cool."""
    exposure_s: Positive
    """Exposure time; always manual, and compared with what each frame reports."""
    iso: int = Field(default=100, ge=100, le=1600)
    """Gain as ISO value; always manual, and compared with what each frame reports."""
    lens_position: int | None = Field(default=None, ge=0, le=255)
    """Locked focus; must be given for sensors with autofocus, and only for them."""
    white_balance_k: int | None = Field(default=None, ge=1000, le=12000)
    """Locked white balance, colour temperature in kelvin; for colour sensors."""
    sync: Literal["auto", "off", "driven", "external", "ptp"] = "auto"
    """Hardware synchronisation. `auto`: as the board does by itself (the pair of an OAK-D is in
    step); `off`: every sensor runs freely; `driven`: `sync_driver` pulses all others; `external`:
    pulses come from outside; `ptp`: by network time."""
    sync_driver: str | None = None
    """The view whose sensor drives the others, for `sync = "driven"`."""
    joins_sync_lines: bool = False
    """OAK-FFC-4P only: connect the sync line of CAM_A and CAM_D with that of CAM_B and CAM_C."""
    reconnects: int = Field(default=3, ge=0)
    """How often a live stream looks for a lost device again. A grab of a sweep never goes on across
    a loss: nobody knows whether the camera still stands where it stood."""

    @property
    def is_simulated(self) -> bool:
        """Whether there is no device behind the pipeline; its sensors look at the `world`."""
        return self.device.startswith("sim://")

    @property
    def needs_real_time(self) -> bool:
        """See `CameraConfig.needs_real_time`; its pipeline runs in real time."""
        return self.is_simulated

    @property
    def by_view(self) -> Mapping[str, Mapping[str, object]]:
        """See `CameraConfig.by_view`."""
        return {"sockets": self.sockets}

    @property
    def size_px(self) -> tuple[int, int]:
        """See `CameraConfig.size_px`."""
        return self.width_px, self.height_px

    @property
    def asked_rate_hz(self) -> float:
        """See `CameraConfig.asked_rate_hz`."""
        return self.rate_hz

    @property
    def by_device(self) -> dict[str, dict[str, str]]:
        """By device: the sockets of its views."""
        grouped: dict[str, dict[str, str]] = {}
        for view, socket in self.sockets.items():
            device, _, name = socket.rpartition("/")
            grouped.setdefault(device or self.device, {})[view] = name
        return grouped

    @model_validator(mode="after")
    def _exposure_fits_the_rate(self) -> Self:
        if self.exposure_s * self.rate_hz >= 1.0:
            raise ValueError(
                f"exposure_s = {self.exposure_s} is no shorter than a frame at rate_hz = "
                f"{self.rate_hz} ({1.0 / self.rate_hz:.4f} s); shorten it or lower the rate"
            )
        return self

    @model_validator(mode="after")
    def _sensors_differ_and_one_drives(self) -> Self:
        if len(set(self.sockets.values())) != len(self.sockets):
            raise ValueError(
                f"sockets must differ, found {', '.join(sorted(self.sockets.values()))}"
            )
        if (self.sync == "driven") != (self.sync_driver is not None):
            raise ValueError('sync = "driven" and sync_driver belong together; give both or none')
        if self.sync_driver is not None and self.sync_driver not in self.sockets:
            raise ValueError(
                f"sync_driver {self.sync_driver} is no view; there are: {', '.join(self.sockets)}"
            )
        return self


class RecordingCameraConfig(CameraConfig):
    """A recording of `rig capture --record` instead of a device."""

    path_keys: ClassVar[tuple[str, ...]] = ("file",)

    kind: Literal["recording"]
    """Selects a recording."""
    file: str
    """The MCAP file; relative paths start at the profile file."""

    @property
    def is_stored(self) -> bool:
        """See `CameraConfig.is_stored`."""
        return True


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
    width_px: int = Field(ge=16)
    """Image width, as the devices offer it."""
    height_px: int = Field(ge=16)
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
