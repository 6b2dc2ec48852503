"""Cameras in a profile: one closed model per kind, told apart by `kind`."""

from typing import Annotated, Literal

from pydantic import Field

from rig.profile.model import Model, Positive


class CameraLimits(Model):
    """What every kind of camera has to keep."""

    timeout_s: Positive = 3.0
    """Longest wait for one multi-view."""
    max_skew_s: Positive = 0.005
    """Largest time between the exposures of one multi-view; anything above is dropped."""


class SimCameraConfig(CameraLimits):
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


class FolderCameraConfig(CameraLimits):
    """Stored images instead of a device."""

    kind: Literal["folder"]
    """Selects stored images."""
    folder: str
    """Folder with the images; relative paths start at the profile file."""
    files: dict[str, str]
    """By view name: a file name or pattern (`left_*.png`); one match per multi-view, in order."""


CameraConfig = Annotated[SimCameraConfig | FolderCameraConfig, Field(discriminator="kind")]
