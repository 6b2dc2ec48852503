"""One capture from request to summary."""

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.capture.folder import CaptureFolder
from rig.capture.picture import write_picture
from rig.capture.tally import CaptureTally, in_words
from rig.interrupts import Interrupts
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.profile import Profile
from rig.progress import Progress
from rig.recording import RecordingWriter
from rig.stored import RunCurve


@dataclass(frozen=True, slots=True)
class CaptureRequest:
    """What a capture is to do."""

    frames: int | None
    """Stop after so many multi-views; None goes on."""
    duration_s: float | None
    """Stop after so many seconds; None goes on."""
    folder: Path | None
    """Where maps go; None writes nothing."""
    recording: Path | None = None
    """New MCAP file for all multi-views that are measured; None records nothing."""

    @property
    def ends(self) -> bool:
        """Whether the capture ends by itself."""
        return self.frames is not None or self.duration_s is not None


@dataclass(frozen=True, slots=True)
class Spread:
    """How a number went over the multi-views of a capture; NaN where there were none."""

    median: float
    p95: float
    """95th percentile."""
    largest: float

    @classmethod
    def of(cls, values: Sequence[float]) -> "Spread":
        """Return the spread of some values."""
        if not values:
            return cls(math.nan, math.nan, math.nan)
        return cls(*(float(np.percentile(values, percent)) for percent in (50, 95, 100)))


@dataclass(frozen=True, slots=True)
class CaptureSummary:
    """What a capture did."""

    curve: RunCurve | None
    """None where slopes were measured only."""
    frames: int
    frames_per_s: float
    latency_s: Spread
    skew_s: Spread
    dropped: dict[str, int]
    """By reason."""
    valid_pct: float
    folder: Path | None
    picture: Path | None
    is_interrupted: bool
    failed_gate: str | None


def capture_depth(
    camera: DepthCamera, request: CaptureRequest, progress: Progress
) -> CaptureSummary:
    """Capture until the request is fulfilled, the camera ends, or Ctrl-C.

    Args:
        camera: open; without a curve slopes are measured only.
        request: how long, and where maps go.
        progress: told of every measured multi-view.

    Raises:
        CurveError: rows miss otherwise than when the curve was made.
        DeviceError: the camera failed; what was written before is kept.
        StoreError: the folder or the recording cannot be written.
    """
    run, tally = camera.run, CaptureTally()
    last: DepthFrame | None = None
    is_interrupted = False
    begun_s = time.monotonic()
    with ExitStack() as outputs, Interrupts() as interrupts:
        recording = folder = None
        if request.recording is not None:
            recording = outputs.enter_context(
                RecordingWriter(request.recording, camera.views, camera.identity)
            )
        if request.folder is not None:
            folder = outputs.enter_context(closing(CaptureFolder(request.folder, run)))
        try:
            for frame in _until(camera, request, begun_s):
                with interrupts.deferred():
                    tally.add(frame)
                    if folder is not None:
                        folder.write(frame)
                    if recording is not None:
                        recording.write(frame.views)
                    last = frame
                    progress(len(tally.latencies_s), in_words(frame))
        except KeyboardInterrupt:
            is_interrupted = True
        took_s = time.monotonic() - begun_s
        picture = None
        if folder is not None and last is not None:
            picture = write_picture(folder.folder / "last_frame.png", last, run.profile.reference)
    return CaptureSummary(
        curve=camera.run.curve,
        frames=len(tally.latencies_s),
        frames_per_s=len(tally.latencies_s) / took_s if took_s > 0.0 else 0.0,
        latency_s=Spread.of(tally.latencies_s),
        skew_s=Spread.of(tally.skews_s),
        dropped=dict(camera.dropped),
        valid_pct=tally.valid_pct,
        folder=request.folder,
        picture=picture,
        is_interrupted=is_interrupted,
        failed_gate=_failed_gate(run.profile, tally),
    )


def _until(camera: DepthCamera, request: CaptureRequest, begun_s: float) -> Iterator[DepthFrame]:
    for count, frame in enumerate(camera, start=1):
        yield frame
        if request.frames is not None and count >= request.frames:
            return
        if request.duration_s is not None and time.monotonic() - begun_s >= request.duration_s:
            return


def _failed_gate(profile: Profile, tally: CaptureTally) -> str | None:
    if not tally.latencies_s:
        return "no multi-view was measured"
    least_pct = profile.quality.valid_share_pct
    if tally.valid_pct < least_pct:
        return f"{tally.valid_pct:.1f} % of the pixels have an answer, asked for {least_pct:.1f} %"
    return None
