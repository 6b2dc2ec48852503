"""One capture from request to summary."""

import math
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path

from rig.capture.folder import PICTURE, CaptureFolder, require_free
from rig.capture.output import WantedOutput
from rig.capture.output_thread import OutputSummary
from rig.capture.outputs import Outputs, open_outputs
from rig.capture.recording import RECORDINGS
from rig.capture.rows_offer import RowsOffer
from rig.capture.spread import Spread
from rig.capture.tally import CaptureTally, in_words
from rig.database import software_versions, this_program
from rig.errors import RigError
from rig.interrupts import Interrupts
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.profile import Profile
from rig.progress import Progress, Tell
from rig.secrets import value_without_secrets
from rig.stored import RunCurve
from rig.unit import unit_of


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
    recorded_as: str = "foxglove"
    """What the recording is, see `rig.capture.recording.RECORDINGS`."""
    points: bool = False
    """Whether to record the cloud as well."""
    outputs: tuple[WantedOutput, ...] = ()
    """What else takes the depth: a page, topics, files of other programs."""
    note: str = ""
    """Free text of the user."""
    tags: tuple[str, ...] = ()
    """Words to find it again by."""
    resume: bool = False
    """Whether the newest scan of a camera that moves is gone on with."""

    @property
    def ends(self) -> bool:
        """Whether the capture ends by itself."""
        return self.frames is not None or self.duration_s is not None


@dataclass(frozen=True, slots=True)
class CaptureSummary:
    """What a capture did."""

    curve: RunCurve | None
    """None where slopes were measured only."""
    is_simulated: bool
    """Whether the camera is: it then takes its time to render."""
    frames: int
    took_s: float
    """From the first multi-view that was asked for to the last one that was measured."""
    waited_s: float
    """What of it was waiting for the camera."""
    latency_s: Spread
    """From mid-exposure until the depth was ready."""
    measuring_s: Spread
    skew_s: Spread
    dropped: dict[str, int]
    """Multi-views that were not measured, by reason."""
    outputs: tuple[OutputSummary, ...]
    valid_pct: float
    valid_mm: tuple[float, float] | None
    """Range of the curve: nothing nearer or farther has a depth. None for slopes only."""
    board_rms_mm: float | None
    """Rms error of the board's plane at held-out distances, as the curve's sweep found it."""
    median_k2: float | None
    """See `Precision.median_k2`."""
    sure_pct: float | None
    """See `Precision.sure_pct`."""
    time_ns: tuple[int, int] | None
    """First and last frame by the wall clock, UTC; None without a frame."""
    folder: Path | None
    is_interrupted: bool
    failed_gate: str | None
    failure: RigError | None
    """Of the first output that was to be kept and is not whole."""

    @property
    def frames_per_s(self) -> float:
        """As they came."""
        return self.frames / self.took_s if self.took_s > 0.0 else 0.0

    @property
    def measured_per_s(self) -> float:
        """As they would come if the camera were never waited for; NaN without a frame."""
        busy_s = self.took_s - self.waited_s
        return self.frames / busy_s if self.frames and busy_s > 0.0 else math.nan

    @property
    def picture(self) -> Path | None:
        """The picture of the last frame, in the folder."""
        path = None if self.folder is None else self.folder / PICTURE
        return path if path is not None and path.is_file() else None


def capture_depth(
    camera: DepthCamera,
    request: CaptureRequest,
    progress: Progress,
    tell: Tell = lambda _: None,
    watch: Callable[[DepthFrame], DepthFrame] = lambda frame: frame,
) -> CaptureSummary:
    """Capture until the request is fulfilled, the camera ends, no output is left, or Ctrl-C.

    Args:
        camera: open; without a curve slopes are measured only.
        request: how long, and where depth goes.
        progress: told of every measured multi-view.
        tell: told of an output that fails; the capture goes on with the others, and the summary
            has the error. Also told once where rows do not meet.
        watch: given every frame, returns it, maybe with a warning; must return at once.

    Raises:
        CurveError: rows miss otherwise than when the curve was made.
        DeviceError: the camera failed; what was written before is kept.
        RigError: an output cannot be opened.
    """
    run, tally = camera.run, CaptureTally()
    offer = RowsOffer(run.profile, tell)
    is_interrupted = False
    begun_s, waited_before_s = time.monotonic(), camera.waited_s
    took_s = 0.0
    with Interrupts() as interrupts:
        wanted = _wanted(request)
        outputs = open_outputs(camera, wanted, waits=camera.can_wait, tell=tell)
        try:
            with closing(_multiviews(camera)) as frames:
                for measured in _until(frames, request, begun_s):
                    with interrupts.deferred():
                        frame = watch(measured)
                        tally.add(frame)
                        offer.look(frame)
                        outputs.offer(frame)
                        progress(tally.frames, in_words(frame))
                    if not outputs.take_frames:
                        break
        except KeyboardInterrupt:
            is_interrupted = True
        finally:
            took_s = time.monotonic() - begun_s
            is_interrupted |= _finish(
                outputs, nullcontext() if is_interrupted else interrupts.deferred()
            )
    return CaptureSummary(
        curve=camera.run.curve,
        is_simulated=run.profile.camera.is_simulated,
        frames=tally.frames,
        took_s=took_s,
        waited_s=camera.waited_s - waited_before_s,
        latency_s=tally.latency_s.spread,
        measuring_s=tally.measuring_s.spread,
        skew_s=tally.skew_s.spread,
        dropped=dict(camera.dropped),
        outputs=outputs.summaries,
        valid_pct=tally.valid_pct,
        valid_mm=None if run.curve is None else run.curve.curve.valid_mm,
        board_rms_mm=None if run.curve is None else run.curve.holdout_rms_mm,
        median_k2=tally.precision.median_k2,
        sure_pct=tally.precision.sure_pct(tally.frames),
        time_ns=tally.time_ns,
        folder=request.folder,
        is_interrupted=is_interrupted,
        failed_gate=_failed_gate(run.profile, tally),
        failure=next((o.failure for o in outputs.summaries if o.is_kept and o.failure), None),
    )


def _wanted(request: CaptureRequest) -> Iterator[WantedOutput]:
    """Yield all outputs of a request; what may not be overwritten first."""
    recording, folder = request.recording, request.folder
    if folder is not None:
        require_free(folder, resumes=request.resume)  # before a recording is begun
    if recording is not None:
        yield WantedOutput(
            lambda camera: RECORDINGS[request.recorded_as](recording, camera, request.points),
            is_kept=True,
        )
    yield from request.outputs
    if folder is not None:
        yield WantedOutput(
            lambda camera: CaptureFolder(
                folder, camera.run, _made(camera, request), resumes=request.resume
            ),
            is_kept=True,
        )


def _made(camera: DepthCamera, request: CaptureRequest) -> dict[str, object]:
    """Return who captures and with what, without secrets."""
    profile = camera.run.profile
    return {
        "rig": profile.name,
        "unit": unit_of(profile, camera.identity),
        "note": request.note,
        **asdict(this_program(request.tags)),
        "devices": {"camera": dict(camera.identity)},
        "versions": software_versions(),
        "profile": value_without_secrets(profile.model_dump(mode="json")),
    }


def _finish(outputs: Outputs, deferral: AbstractContextManager[None]) -> bool:
    """Finish all outputs; return whether Ctrl-C was pressed meanwhile, for the first time.

    The second time gives up: what still waits is not written.
    """
    try:
        with deferral:
            outputs.finish()
    except KeyboardInterrupt:
        if not outputs.summaries:
            raise
        return True
    return False


def _multiviews(camera: DepthCamera) -> Generator[DepthFrame]:
    """Yield what the camera gives: of one that moves scan after scan, each of its own."""
    if not camera.run.profile.camera.is_scan:
        yield from camera
        return
    while True:
        yield camera.grab()


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
    if not tally.frames:
        return "no multi-view was measured"
    least_pct = profile.quality.valid_share_pct
    if tally.valid_pct < least_pct:
        return f"{tally.valid_pct:.1f} % of the pixels have an answer, asked for {least_pct:.1f} %"
    return None
