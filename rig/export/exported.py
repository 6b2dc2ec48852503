"""What an export has written, as values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rig.export.lens_change import Refit


@dataclass(frozen=True, slots=True)
class ExportedGeometry:
    """A calibration, and what had to be changed for it."""

    path: Path
    gap_px: float
    """Largest distance of a point between the file, read back, and what was written."""
    refits: Mapping[str, Refit] = field(default_factory=dict[str, Refit])
    """By view: lenses that were replaced by the nearest that the format can hold."""
    backup: Path | None = None
    """What a device held before it got this calibration; None where none did."""
    weak: str | None = None
    """Verdict of a weak calibration; None for a good one."""
    tells_weak: bool = False
    """Whether the format has comments, in which a weak one's verdict stands."""


@dataclass(frozen=True, slots=True)
class ExportedSamples:
    """The samples of a sweep."""

    path: Path
    rows: int


@dataclass(frozen=True, slots=True)
class ExportedDepth:
    """The points of a depth map."""

    path: Path
    points: int


@dataclass(frozen=True, slots=True)
class ExportedCapture:
    """The frames of a capture."""

    path: Path
    """File or folder that was written."""
    frames: int
    points: int | None = None
    """Of all frames together; None where the format holds no points."""


Exported = ExportedGeometry | ExportedSamples | ExportedDepth
