"""OAK cameras in a profile."""

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rig.profile.cameras import CameraConfig, PictureSide
from rig.profile.model import Model, Positive

OakPixels = Literal["gray8", "raw10", "nv12"]


class OakSensorConfig(Model):
    """What is different for the sensor of one view; what is not given is as for all."""

    width_px: PictureSide | None = None
    """Image width."""
    height_px: PictureSide | None = None
    """Image height."""
    pixels: OakPixels | None = None
    """How the pixels come."""
    exposure_s: Positive | None = None
    """Exposure time."""
    iso: int | None = Field(default=None, ge=100, le=1600)
    """Gain as ISO value."""
    lens_position: int | None = Field(default=None, ge=0, le=255)
    """Locked focus."""
    white_balance_k: int | None = Field(default=None, ge=1000, le=12000)
    """Locked white balance, colour temperature in kelvin."""

    @property
    def given(self) -> dict[str, object]:
        """What is different, by its key."""
        return self.model_dump(exclude_none=True)


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
    width_px: int = Field(ge=16, le=16384)
    """Image width."""
    height_px: int = Field(ge=16, le=16384)
    """Image height."""
    pixels: OakPixels = "gray8"
    """`gray8`: 8 bit through the image processor; `raw10`: 10 bit as the sensor gives them, for
    monochrome sensors; `nv12`: as `gray8`, and colour at a quarter of the pixels, for colour
    sensors."""
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
    sensors: dict[str, OakSensorConfig] = Field(default={})
    """By view name: what is different for its sensor, as the colour camera of an OAK-D."""
    ir_flood_share: float = Field(default=0.0, ge=0.0, le=1.0)
    """Brightness of the infrared flood light, of the most that it can; 0 is off. The projector of
    dots is always off: they would be taken for edges."""
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

    def of(self, view: str) -> "OakCameraConfig":
        """Return what holds for the sensor of one view."""
        sensor = self.sensors.get(view)
        return self if sensor is None else self.model_copy(update=sensor.given)

    def size_of(self, view: str) -> tuple[int, int]:
        """See `CameraConfig.size_of`."""
        return self.of(view).size_px

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
        unknown = sorted(set(self.sensors) - set(self.sockets))
        if unknown:
            raise ValueError(
                f"sensors names no view: {', '.join(unknown)}; there are {', '.join(self.sockets)}"
            )
        for view in ("", *self.sensors):
            exposure_s = self.of(view).exposure_s
            if exposure_s * self.rate_hz >= 1.0:
                where = f"sensors.{view}." if view else ""
                raise ValueError(
                    f"{where}exposure_s = {exposure_s} is no shorter than a frame at rate_hz = "
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
