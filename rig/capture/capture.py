"""One capture from request to summary."""

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.capture.folder import PICTURE, CaptureFolder
from rig.capture.output import WantedOutput
from rig.capture.output_thread import OutputSummary
from rig.capture.outputs import Outputs, open_outputs
from rig.capture.recording import CaptureRecording
from rig.capture.tally import CaptureTally, in_words
from rig.errors import RigError
from rig.interrupts import Interrupts
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.profile import Profile
from rig.progress import Progress, Tell


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
    outputs: tuple[WantedOutput, ...] = ()
    """What else takes the depth: a page, topics, files of other programs."""

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

    curve_id: int | None
    """None where slopes were measured only."""
    frames: int
    frames_per_s: float
    latency_s: Spread
    skew_s: Spread
    dropped: dict[str, int]
    """Multi-views that were not measured, by reason."""
    outputs: tuple[OutputSummary, ...]
    valid_pct: float
    folder: Path | None
    is_interrupted: bool
    failed_gate: str | None
    failure: RigError | None
    """Of the first output that was to be kept and is not whole."""

    @property
    def picture(self) -> Path | None:
        """The picture of the last frame, in the folder."""
        path = None if self.folder is None else self.folder / PICTURE
        return path if path is not None and path.is_file() else None


def capture_depth(
    camera: DepthCamera, request: CaptureRequest, progress: Progress, tell: Tell = lambda _: None
) -> CaptureSummary:
    """Capture until the request is fulfilled, the camera ends, no output is left, or Ctrl-C.

    Args:
        camera: open; without a curve slopes are measured only.
        request: how long, and where depth goes.
        progress: told of every measured multi-view.
        tell: told of an output that fails; the capture goes on with the others, and the summary
            has the error.

    Raises:
        CurveError: rows miss otherwise than when the curve was made.
        DeviceError: the camera failed; what was written before is kept.
        RigError: an output cannot be opened.
    """
    run, tally = camera.run, CaptureTally()
    is_interrupted = False
    begun_s = took_s = time.monotonic()
    with Interrupts() as interrupts:
        wanted = _wanted(request)
        outputs = open_outputs(camera, wanted, waits=camera.can_wait, tell=tell)
        try:
            with closing(iter(camera)) as frames:
                for frame in _until(frames, request, begun_s):
                    with interrupts.deferred():
                        tally.add(frame)
                        outputs.offer(frame)
                        progress(len(tally.latencies_s), in_words(frame))
                    if not outputs.take_frames:
                        break
        except KeyboardInterrupt:
            is_interrupted = True
        finally:
            took_s = time.monotonic() - begun_s
            is_interrupted |= _finished(outputs, interrupts)
    return CaptureSummary(
        curve_id=None if run.curve is None else run.curve.id,
        frames=len(tally.latencies_s),
        frames_per_s=len(tally.latencies_s) / took_s if took_s > 0.0 else 0.0,
        latency_s=Spread.of(tally.latencies_s),
        skew_s=Spread.of(tally.skews_s),
        dropped=dict(camera.dropped),
        outputs=outputs.summaries,
        valid_pct=tally.valid_pct,
        folder=request.folder,
        is_interrupted=is_interrupted,
        failed_gate=_failed_gate(run.profile, tally),
        failure=next((o.failure for o in outputs.summaries if o.is_kept and o.failure), None),
    )


def _wanted(request: CaptureRequest) -> Iterator[WantedOutput]:
    """Yield all outputs of a request; what may not be overwritten first."""
    recording, folder = request.recording, request.folder
    if recording is not None:
        yield WantedOutput(lambda camera: CaptureRecording(recording, camera), is_kept=True)
    yield from request.outputs
    if folder is not None:
        yield WantedOutput(lambda camera: CaptureFolder(folder, camera.run), is_kept=True)


def _finished(outputs: Outputs, interrupts: Interrupts) -> bool:
    """Finish all outputs; return whether Ctrl-C was pressed meanwhile. A second one gives up."""
    try:
        with interrupts.deferred():
            outputs.finish()
    except KeyboardInterrupt:
        if not outputs.summaries:
            raise
        return True
    return False


def _until(
    frames: Iterator[DepthFrame], request: CaptureRequest, begun_s: float
) -> Iterator[DepthFrame]:
    for count, frame in enumerate(frames, start=1):
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
