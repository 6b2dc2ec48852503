"""A light field from one camera that moved: what a scan was, beside its views."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from rig.errors import StoreError
from rig.json_codec import Codec

if TYPE_CHECKING:  # frames name this value, and stay light
    from rig.devices import Camera
    from rig.frames import Frame

REFERENCE_ROLES = ("first", "again", "last")
"""Takes of the reference beside its view: before all others, after a resumption, after all."""


@dataclass(frozen=True, slots=True)
class Take:
    """One picture of a scan: where the camera stood, when, and how bright the scene was."""

    view: str
    role: str
    """`view`, or one of `REFERENCE_ROLES`."""
    row_mm: float
    """Position of the stage along the row, read back."""
    column_mm: float | None
    """The same along the column; None where no stage moves it so."""
    timestamp_s: float
    """Middle of its exposure."""
    session: int
    """A scan that was resumed has several; times of one are no times of another."""
    temperature_degc: float | None
    gain: float = 1.0
    """Brightness of the scene in this take over that in the view of the reference,"""
    offset_levels: float = 0.0
    """and the grey levels that are added to it: grey = gain * reference + offset. Both are taken
    out of the view."""


@dataclass(frozen=True, slots=True)
class ScanTimes:
    """Where the time of a scan went, on the bench's clock."""

    moves_s: float = 0.0
    settling_s: float = 0.0
    exposures_s: float = 0.0
    total_s: float = 0.0

    @property
    def needed_s(self) -> float:
        """What the bench itself needed; all else is overhead."""
        return self.moves_s + self.settling_s + self.exposures_s


@dataclass(frozen=True, slots=True)
class ScanFacts:
    """What is known of a scan beside its pixels."""

    takes: tuple[Take, ...]
    """In the order in which they were taken."""
    times: ScanTimes = ScanTimes()
    """Of the last session."""

    @property
    def positions_mm(self) -> dict[str, tuple[float, float | None]]:
        """By view: positions along row and column, read back."""
        return {t.view: (t.row_mm, t.column_mm) for t in self.takes if t.role == "view"}

    @property
    def brightness_drift(self) -> float:
        """Largest change of brightness between two takes of the scan, relative."""
        gains = [take.gain for take in self.takes]
        return max(gains) / min(gains) - 1.0


@dataclass(frozen=True, slots=True)
class Scan:
    """That a multi-view is a scan: its views are of different instants of one scene at rest."""

    facts: ScanFacts
    reference: "tuple[Frame, ...]" = ()
    """All takes of the reference in order of time, as they came from the camera: at the start, its
    view in the middle, at the end."""


SCAN_FACTS = Codec(
    ScanFacts, name="scan", error=StoreError, advice="bring the file back from a copy"
)


@runtime_checkable
class MovedCamera(Protocol):
    """What a camera that stages carry lets a pre-flight do beside whole scans."""

    @property
    def carried(self) -> "Camera":
        """The camera that is carried, open while this one is."""
        ...

    @property
    def row_mm(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        """Places of the carriers at the near end of the row, at the reference, at the far end."""
        ...

    def go(self, places_mm: tuple[float, ...]) -> tuple[float, ...]:
        """Home where that is needed, move without settling, and return the positions read back.

        Raises:
            DeviceError: a stage failed; all of them are stopped.
        """
        ...
