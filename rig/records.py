"""Sweeps, samples, curves and calibrations as they are kept: plain values that know no database."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Literal

from rig.plan import Stop

State = Literal["taking", "taken", "concluded", "failed"]
"""`taking`: samples are missing; a program works on it, or it was interrupted or killed. `taken`:
only the curve is missing. `concluded`: it has its samples and a curve. `failed`: an error ended
it."""
Json = Mapping[str, object]
"""What becomes one JSON object: text keys, finite numbers."""
SampleKey = tuple[int, int]
"""Stop index and sample number within a sweep."""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Who made something, and how; empty where nobody wrote it down."""

    user: str = ""
    host: str = ""
    command: str = ""
    """The command line, without secrets."""
    tags: tuple[str, ...] = ()
    """Words of the user to find it again by."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """One sweep and all that is needed to understand it years later."""

    id: int
    rig: str
    profile: Json
    """The whole profile as it was used."""
    versions: Json
    """Software by name: see `software_versions`."""
    devices: Json
    """Identity of camera and stage."""
    stops: tuple[Stop, ...]
    """The plan, in the order of visits."""
    samples_per_stop: int
    started_at: datetime
    """UTC."""
    ended_at: datetime | None
    """UTC, when its last sample was stored, or when it was interrupted or failed; None while
    samples are taken, or when it was killed."""
    state: State
    folder: Path
    """Where its frames are."""
    note: str
    calibration_id: int | None = None
    """Geometric calibration that its slopes are measured with; None for pictures as they are."""
    unit: str = ""
    """Which of the rigs of this name: see `rig.unit`; empty where nobody knows."""
    provenance: Provenance = Provenance()


@dataclass(frozen=True, slots=True)
class StoredFrame:
    """One image on disk."""

    view: str
    timestamp_s: float
    """Middle of the exposure on the clock of the camera's host."""
    sequence: int
    exposure_s: float | None
    sha256: str
    """Of the PNG file."""
    bits: int | None = None
    """Bits of a grey value; None: all that a pixel of the file has."""
    uncertainty_s: float = 0.0
    """How much earlier than `timestamp_s` the middle of the exposure may have been."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One multi-view of a sweep; `Store.load` brings its images back."""

    sweep_id: int
    stop: Stop
    number: int
    """Within its stop, from 0."""
    reached_mm: float
    """Position of the stage, read back."""
    taken_at: datetime
    """UTC, when it was stored."""
    temperature_degc: float | None
    folder: Path
    """Holds one PNG per view."""
    frames: tuple[StoredFrame, ...]
    """In the camera's order."""
    pruned_at: datetime | None = None
    """UTC, when its images were given up on purpose; what was measured in them stays."""

    @property
    def key(self) -> SampleKey:
        """Stop index and sample number."""
        return self.stop.index, self.number

    @property
    def skew_s(self) -> float:
        """Time between the first and the last exposure among the views."""
        times_s = [frame.timestamp_s for frame in self.frames]
        return max(times_s) - min(times_s)


@dataclass(frozen=True, slots=True)
class StoredCurve:
    """A depth-slope curve and the sweep that it comes from."""

    id: int
    rig: str
    sweep_id: int
    created_at: datetime
    """UTC."""
    curve: Json
    """Model, parameters, covariance, valid range: what the curve needs to come back."""
    holdout: Json
    """Error at the held-out distances."""
    versions: Json
    active: bool
    """Whether captures may pick it."""
    calibration_id: int | None = None
    """Geometric calibration that its slopes were measured with; None for pictures as they are."""
    row_errors: Json | None = None
    """What the rows of the views missed by in its sweep (`rig.epipolar.mending.row_errors`); None
    where nobody looked: its slopes may be those of rows that do not meet."""
    unit: str = ""
    """Which of the rigs of this name; empty where nobody knows."""
    provenance: Provenance = Provenance()


@dataclass(frozen=True, slots=True)
class StoredCalibration:
    """A geometric calibration and what it was made with."""

    id: int
    rig: str
    created_at: datetime
    """UTC."""
    geometry: Json
    """Cameras, poses, stage, covariance: see `rig.geometry.rig_geometry_json`."""
    quality: Json
    """What it is worth: residuals, depth error, verdict."""
    profile: Json
    """The whole profile as it was used."""
    versions: Json
    devices: Json
    """Identity of camera and stage, with serial numbers."""
    temperature_degc: float | None
    """Of the camera, where it reports one."""
    image_size_px: tuple[int, int]
    """Width and height of the pictures."""
    active: bool
    """Whether sweeps and captures take it by themselves."""
    unit: str = ""
    """Which of the rigs of this name; empty where nobody knows."""
    note: str = ""
    provenance: Provenance = Provenance()


@dataclass(frozen=True, slots=True)
class StoredDrift:
    """What one scene told of the cameras of a rig since its calibration."""

    id: int
    rig: str
    calibration_id: int
    measured_at: datetime
    """UTC."""
    temperature_degc: float | None
    """Of the camera, where it reports one."""
    details: Json
    """Turns of the views, how sure they are, and what they mean for depth."""
    unit: str = ""
    """Which of the rigs of this name; empty where nobody knows."""


@dataclass(frozen=True, slots=True)
class HistoryRow:
    """One line of `rig history`."""

    id: int
    rig: str
    started_at: datetime
    ended_at: datetime | None
    state: State
    stops_done: int
    """Stops that have all their samples."""
    stops_planned: int
    samples: int
    curve_id: int | None
    """Newest curve of this sweep."""
    holdout_rms_pct: float | None
    """rms depth error of that curve at held-out distances, per cent."""
    rows_rms_px: float | None = None
    """By how much the rows of its worst view missed, rms; None where nobody looked."""
    at_work: str | None = None
    """The program that works on it; None where none does."""
    unit: str = ""
    note: str = ""
    provenance: Provenance = Provenance()
    devices: Json = field(default_factory=dict[str, object])
    """Identity of camera and stage, with their firmware."""
    versions: Json = field(default_factory=dict[str, object])
    """Of the software that took it."""
    pruned: int = 0
    """Samples whose images were given up on purpose."""
    is_active: bool = False
    """Whether captures may pick its newest curve."""
    missing: int = 0
    """Samples whose images should be on the disk, and are not."""


@dataclass(frozen=True, slots=True)
class DamagedRow:
    """A row that cannot be read."""

    table: str
    number: str
    """Its key, as far as that can be read."""
    found: str


@dataclass(frozen=True, slots=True)
class History:
    """What is stored, as far as it can be read."""

    sweeps: tuple[HistoryRow, ...]
    calibrations: tuple[StoredCalibration, ...]
    damaged: tuple[DamagedRow, ...]
    drifts: tuple[StoredDrift, ...] = ()
