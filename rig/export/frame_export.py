"""What is common to the formats that hold one frame of a capture per file."""

from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from rig.errors import StoreError
from rig.export.exported import ExportedCapture
from rig.export.frame_choice import FrameChoice
from rig.live.captured import CapturedFrame, read_capture


@dataclass(frozen=True, slots=True)
class FrameExport(ABC):
    """Writes the frames of a capture into a folder, a `CaptureExporter`."""

    format: ClassVar[str]
    """Name of the format."""

    frames: str | None = None
    """Which frames, see `FrameChoice`; None for all."""

    def __post_init__(self) -> None:
        if self.frames is not None:
            FrameChoice.parse(self.frames)

    def export(self, source: Path, out: Path | None) -> ExportedCapture:
        """See `CaptureExporter.export`."""
        captured = read_capture(source)
        if self.frames is not None:
            captured = FrameChoice.parse(self.frames).of(captured)
        folder = out or Path(f"{source.resolve().stem}_{self.format}")
        is_new = not folder.exists()
        points: list[int | None] = []
        try:
            for frame in captured:
                _make(folder)
                points.append(self.write(frame, folder))
        except BaseException:
            if is_new:
                with suppress(OSError):  # there is no folder, or it holds frames by now
                    folder.rmdir()
            raise
        if not points:
            raise StoreError(f"{source}: has no frames", advice="capture again")
        known = [count for count in points if count is not None]
        return ExportedCapture(folder, len(points), sum(known) if known else None)

    @abstractmethod
    def write(self, frame: CapturedFrame, folder: Path) -> int | None:
        """Write one frame into a folder; return how many points it has, if it has some."""
        ...


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(
            f"{folder}: cannot be made: {error.strerror}", advice="choose another with --out"
        ) from error


def times_of(frame: CapturedFrame) -> dict[str, object]:
    """When a frame was exposed: by the wall clock where it is known, and on the host's clock."""
    return {"frame": frame.index, "time_ns": frame.time_ns, "timestamp_s": frame.timestamp_s}
