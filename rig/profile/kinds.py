"""What rig has to know of a kind of camera or stage: one value each, built in or plugged in."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from rig.discovery import FoundPicture, Search
from rig.profile.cameras import CameraConfig
from rig.profile.stages import StageConfig
from rig.profile.views import ViewConfig

if TYPE_CHECKING:  # profiles are read without what devices need
    from rig.devices import Bystander, Camera, Clock, Stage

CONTRACT = 1
"""Version of the values of this module and of `rig.devices`; a kind says for which it is made."""

CameraConfigT = TypeVar("CameraConfigT", bound=CameraConfig)
StageConfigT = TypeVar("StageConfigT", bound=StageConfig)


@dataclass(frozen=True, slots=True)
class ScanKeeping:
    """Where the takes of scans are kept, each on the disk before the next move."""

    folder: Path
    """Of all scans of the rig; is made where it is missing."""
    resume: bool = False
    """Whether the newest scan in it is gone on with; a complete one is given again."""
    file_mode: int = 0o600
    """Permission bits of its files."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a device is opened in."""

    profile: str
    """Name of the profile, for messages."""
    views: tuple[ViewConfig, ...]
    """Of the profile; every grab of a camera gives them in this order."""
    clock: "Clock"
    """Time of the whole bench; deadlines and times of frames are its times."""
    simulated: object | None = None
    """The simulated bench where the profile has one; what it is only the simulation knows."""
    inner: "Camera | None" = None
    """The camera that a scan carries, not yet opened; None for every other kind."""
    carriers: "tuple[Stage, ...]" = ()
    """The stages that carry it: along the row, then along the column where there is one."""
    scans: ScanKeeping | None = None
    """Where the takes of a scan are kept as they come; None keeps them in memory."""
    bystander: "Bystander | None" = None
    """Who may be asked beside the person at the terminal; None where nobody looks on."""


@dataclass(frozen=True, slots=True)
class NewCamera:
    """What is known of a camera when its section of a new profile is written."""

    views: tuple[str, ...]
    """Names of the views."""
    devices: tuple[str, ...]
    """What is plugged in, by the names that its search gave; perhaps more or fewer than views."""
    width_px: int
    height_px: int
    layout: str | None = None
    """How the views lie in the one picture of the first device; None where each has its own."""
    picture: FoundPicture | None = None
    """The best picture that the first device offers; None where it does not tell."""
    sensors: "Mapping[str, ToldSensor] | None" = None
    """By view name: what the first device has told of its sensors; None where nobody has asked."""


@dataclass(frozen=True, slots=True)
class NewStage:
    """What is known of a stage when its section of a new profile is written."""

    devices: tuple[str, ...]
    """What is plugged in, by the names that its search gave; the first one is likely the stage."""
    near_mm: float
    far_mm: float
    """Nearest and farthest distance that the new profile sweeps over."""


@dataclass(frozen=True, slots=True)
class CameraTemplate:
    """How `rig profile new` describes a camera."""

    title: str
    """What it is made of, as `V4L2 cameras`."""
    section: Callable[[NewCamera], str]
    """Gives `[camera]` as TOML with comments; guesses say MEASURE."""
    views: int | None = None
    """How many views it has when nobody says; None: as many as devices are plugged in."""
    built_in: "tuple[BuiltIn, ...]" = ()
    """The views of one device that knows them itself, one for each number of views; for any other
    number places must be measured."""
    takes_layout: bool = False
    """Whether one device may give all views in one picture, see `NewCamera.layout`."""
    ask: "Callable[[str, float], ToldViews] | None" = None
    """Asks a plugged-in device, by its name, which views it has, within so many s; opens it for
    that. May raise `RigError`. None where no device can tell."""


@dataclass(frozen=True, slots=True)
class BuiltIn:
    """Views that stand in one housing, at places that its maker has calibrated."""

    pitch_mm: float
    places: Mapping[str, tuple[float, float]]
    """By name, in view steps right of and below the first, the reference."""


@dataclass(frozen=True, slots=True)
class ToldSensor:
    """One sensor of a device, as the device tells it."""

    socket: str
    """Where it is, in the device's own word."""
    width_px: int
    height_px: int
    """Of the pictures that a new profile asks it for."""
    has_colour: bool
    has_autofocus: bool


@dataclass(frozen=True, slots=True)
class ToldViews:
    """Which views a plugged-in device says that it has."""

    sensors: Mapping[str, ToldSensor]
    """By view name, the reference first."""
    built_in: BuiltIn | None = None
    """Their places; None where the device does not know them."""


@dataclass(frozen=True, slots=True)
class StageTemplate:
    """How `rig profile new` describes a stage."""

    section: Callable[[NewStage], str]
    """Gives `[stage]` as TOML with comments, `may_move = false`; guesses say MEASURE."""
    adapter: str | None = None
    """A word in lower case by which the description of a plugged-in device tells this kind."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraKind(Generic[CameraConfigT]):
    """A kind of camera: whatever gives one multi-view per grab."""

    contract: int
    """The `CONTRACT` for which it is made, written as a number."""
    name: str
    """`camera.kind` of a profile; the entry point has the same name."""
    config: type[CameraConfigT]
    """Its section of a profile; its `kind` is `Literal[name]`."""
    open: Callable[[CameraConfigT, Surroundings], "Camera"]
    """Gives the camera, not yet opened; imports what it takes only when it is called."""
    search: Search | None = None
    """How `rig devices` finds what is plugged in; kinds may share one."""
    template: CameraTemplate | None = None
    """How a new profile begins with it; None where none does."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StageKind(Generic[StageConfigT]):
    """A kind of stage: whatever carries the target along one axis."""

    contract: int
    """The `CONTRACT` for which it is made, written as a number."""
    name: str
    """`stage.kind` of a profile; the entry point has the same name."""
    config: type[StageConfigT]
    """Its section of a profile; its `kind` is `Literal[name]`."""
    open: Callable[[StageConfigT, Surroundings], "Stage"]
    """Gives the stage, not yet opened; imports what it takes only when it is called."""
    search: Search | None = None
    """How `rig devices` finds what is plugged in; kinds may share one."""
    template: StageTemplate | None = None
    """How a new profile begins with it; None where none does."""
