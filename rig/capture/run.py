"""One capture from request to summary."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.calibrations import NO_CALIBRATION
from rig.capture.folder import CaptureFolder
from rig.capture.live import CaptureTally, Measured, run_capture
from rig.capture.picture import write_picture
from rig.curve import Curve
from rig.devices import Camera
from rig.errors import CurveError
from rig.interrupts import Interrupts
from rig.optics.rectifier import Rectifier
from rig.profile import Profile
from rig.recording import RecordingWriter
from rig.records import StoredCurve


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


@dataclass(frozen=True, slots=True)
class CaptureSummary:
    """What a capture did."""

    frames: int
    frames_per_s: float
    latency_s: tuple[float, float]
    """Median and 95th percentile."""
    skew_s: tuple[float, float, float]
    """Median, 95th percentile, largest."""
    dropped: dict[str, int]
    """By reason."""
    valid_pct: float
    folder: Path | None
    picture: Path | None
    is_interrupted: bool
    failed_gate: str | None

    def as_dict(self) -> dict[str, object]:
        """Return the summary as the command line's JSON contract."""
        return {
            "frames": self.frames,
            "fps": self.frames_per_s,
            "latency_ms": {"p50": 1e3 * self.latency_s[0], "p95": 1e3 * self.latency_s[1]},
            "dropped": sum(self.dropped.values()),
            "dropped_by_reason": dict(self.dropped),
            "valid_pct": self.valid_pct,
            "skew_ms": {
                "p50": 1e3 * self.skew_s[0],
                "p95": 1e3 * self.skew_s[1],
                "max": 1e3 * self.skew_s[2],
            },
            "out": None if self.folder is None else str(self.folder),
        }


def capture_depth(
    rectifier: Rectifier,
    request: CaptureRequest,
    camera: Camera,
    curve: tuple[int, Curve] | None,
    *,
    on_frame: Callable[[Measured, CaptureTally], None],
) -> CaptureSummary:
    """Capture until the request is fulfilled, the camera ends, or Ctrl-C.

    Args:
        rectifier: of the rig.
        request: how long, and where maps go.
        camera: open.
        curve: the curve and its number; None measures slopes only.
        on_frame: told of every measured multi-view.

    Raises:
        DeviceError: the camera failed; what was written before is kept.
        StoreError: the folder or the recording cannot be written.
    """
    profile = rectifier.profile
    tally = CaptureTally()
    curve_id, law = (None, None) if curve is None else curve
    last: Measured | None = None
    is_interrupted = False
    begun_s = time.monotonic()
    with ExitStack() as outputs, Interrupts() as interrupts:
        recording = folder = None
        if request.recording is not None:
            recording = outputs.enter_context(
                RecordingWriter(request.recording, camera.views, camera.identity)
            )
        if request.folder is not None:
            folder = outputs.enter_context(
                closing(CaptureFolder(request.folder, rectifier, curve_id))
            )
        try:
            for measured in _until(run_capture(rectifier, camera, law, tally), request, begun_s):
                with interrupts.held():
                    if folder is not None:
                        folder.write(measured)
                    if recording is not None:
                        recording.write(measured.multiview)
                    last = measured
                    on_frame(measured, tally)
        except KeyboardInterrupt:
            is_interrupted = True
        took_s = time.monotonic() - begun_s
        picture = None
        if folder is not None and last is not None:
            picture = write_picture(folder.folder / "last_frame.png", last, rectifier)
    return CaptureSummary(
        frames=len(tally.latencies_s),
        frames_per_s=len(tally.latencies_s) / took_s if took_s > 0.0 else 0.0,
        latency_s=(_percentile(tally.latencies_s, 50), _percentile(tally.latencies_s, 95)),
        skew_s=(
            _percentile(tally.skews_s, 50),
            _percentile(tally.skews_s, 95),
            _percentile(tally.skews_s, 100),
        ),
        dropped={**camera.dropped, "skew": camera.dropped.get("skew", 0) + tally.skewed},
        valid_pct=tally.valid_pct,
        folder=request.folder,
        picture=picture,
        is_interrupted=is_interrupted,
        failed_gate=_failed_gate(profile, tally),
    )


def require_matching(rectifier: Rectifier, calibrated: Profile, curve: StoredCurve) -> None:
    """Refuse a curve that was measured with another arrangement of cameras.

    Raises:
        CurveError: name, views or pitch differ, or it was measured with another calibration.
    """
    profile, curve_id = rectifier.profile, curve.id
    what = profile.first_difference(calibrated, ("name", "views", "pitch_mm"))
    if what is not None:
        found, asked = getattr(calibrated, what), getattr(profile, what)
        shown = f"{found} there, {asked} here" if what != "views" else "other places of views"
        raise CurveError(
            f"curve {curve_id} belongs to another rig: {what} differs ({shown}); "
            f"run `rig sweep {profile.name}` or choose with --curve"
        )
    if curve.calibration_id != rectifier.calibration_id:
        then, now = (_calibration(i) for i in (curve.calibration_id, rectifier.calibration_id))
        choice = rectifier.calibration_id or NO_CALIBRATION
        raise CurveError(
            f"curve {curve_id} was measured with {then}, asked to use it with {now}: its slopes "
            f"are others; run `rig fit {curve.sweep_id} --calibration {choice}`, or give "
            f"--calibration {curve.calibration_id or NO_CALIBRATION}"
        )


def _calibration(calibration_id: int | None) -> str:
    return "no calibration" if calibration_id is None else f"calibration {calibration_id}"


def _until(
    measured: Iterator[Measured], request: CaptureRequest, begun_s: float
) -> Iterator[Measured]:
    for item in measured:
        yield item
        if request.frames is not None and item.index + 1 >= request.frames:
            return
        if request.duration_s is not None and time.monotonic() - begun_s >= request.duration_s:
            return


def _percentile(values: list[float], percent: float) -> float:
    return float(np.percentile(values, percent)) if values else math.nan


def _failed_gate(profile: Profile, tally: CaptureTally) -> str | None:
    if not tally.latencies_s:
        return "no multi-view was measured"
    least_pct = profile.quality.valid_share_pct
    if tally.valid_pct < least_pct:
        return f"{tally.valid_pct:.1f} % of the pixels have an answer, asked for {least_pct:.1f} %"
    return None
