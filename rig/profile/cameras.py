"""Cameras in a profile: one closed model per kind, told apart by `kind`."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from rig.profile.model import Model, NotNegative, Positive
from rig.profile.parts import PartConfig, by_source, require_parts

PictureSide = Annotated[int, Field(ge=16, le=16384)]


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

    def size_of(self, view: str) -> tuple[int, int] | None:
        """Width and height of the pictures of one view; None where the profile does not say it."""
        del view
        return self.size_px

    @property
    def is_one_picture(self) -> bool:
        """Whether all views are parts of one picture, so that there is no skew between them."""
        return False

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
    width_px: int = Field(ge=16, le=16384)
    """Image width."""
    height_px: int = Field(ge=16, le=16384)
    """Image height."""
    sizes_px: dict[str, tuple[PictureSide, PictureSide]] = Field(default_factory=dict)
    """By view name: width and height, of every view, where they differ."""
    exposure_s: Positive = 0.008
    """Exposure time of every view."""
    frame_interval_s: Positive = 1.0 / 30.0
    """Time between frames."""
    colour: bool = False
    """Whether it gives colour beside its grey values. The world is grey, its light then that of a
    warm lamp; every channel has noise of its own."""

    @property
    def is_simulated(self) -> bool:
        """See `CameraConfig.is_simulated`."""
        return True

    @property
    def size_px(self) -> tuple[int, int]:
        """See `CameraConfig.size_px`."""
        return self.width_px, self.height_px

    def size_of(self, view: str) -> tuple[int, int]:
        """See `CameraConfig.size_of`."""
        return self.sizes_px.get(view, self.size_px)

    @property
    def by_view(self) -> Mapping[str, Mapping[str, object]]:
        """See `CameraConfig.by_view`."""
        return {"sizes_px": self.sizes_px} if self.sizes_px else {}

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
    a video, which holds them all. Views of one picture name the same files, and their `parts`."""
    parts: dict[str, PartConfig] = Field(default={})
    """By view name: which part of the pictures it is, as `"side-by-side:1"`; a view without a part
    is the whole picture."""

    @property
    def is_stored(self) -> bool:
        """See `CameraConfig.is_stored`."""
        return True

    @property
    def by_view(self) -> Mapping[str, Mapping[str, object]]:
        """See `CameraConfig.by_view`."""
        return {"files": self.files}

    @property
    def is_one_picture(self) -> bool:
        """See `CameraConfig.is_one_picture`."""
        return len(self.parts) > 1 and len(by_source(self.files)) == 1

    @model_validator(mode="after")
    def _parts_are_views(self) -> Self:
        require_parts(self.files, self.parts, "files")
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
