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
    def is_scan(self) -> bool:
        """Whether a stage carries it: its views are taken one after the other, and none streams."""
        return False

    @property
    def is_simulated(self) -> bool:
        """Whether it looks at the profile's `world`."""
        return False

    @property
    def may_hold_calibration(self) -> bool:
        """Whether its device may know its own cameras, see `rig.factory.FactoryCalibrated`."""
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
    def may_hold_calibration(self) -> bool:
        """See `CameraConfig.may_hold_calibration`; several devices do not know each other."""
        return len(self.by_device) == 1

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
