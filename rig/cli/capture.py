"""`rig capture`: live metric depth."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.capture_precision import precision_as_dict, precision_in_words
from rig.cli.capture_processing import (
    Decimation,
    FillHoles,
    RegionOfInterest,
    TemporalFrames,
    processing_overrides,
)
from rig.cli.next_verb import tell_next
from rig.cli.options import (
    MOST_FRAMES,
    AsJson,
    CalibrationChoice,
    CurveNumber,
    DatabaseUrl,
    Note,
    Overrides,
    ProfileName,
    Tags,
    finite,
)
from rig.cli.page_options import View, ViewHost, ViewPort, capture_page, page_request
from rig.cli.robot_options import (
    Points,
    RecordAs,
    Serve,
    ServeHost,
    ServePort,
    require_consistent,
    served,
)

if TYPE_CHECKING:
    from rig.capture.capture import CaptureSummary
    from rig.capture.spread import Spread


def capture(
    profile_name: ProfileName,
    *,
    curve_id: CurveNumber = None,
    frames: Annotated[
        int | None,
        typer.Option("--frames", min=1, max=MOST_FRAMES, help="Stop after so many multi-views."),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", min=0.0, help="Stop after so many seconds.", callback=finite),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Write maps into this folder; default: a new one beside the database where "
            "--frames or --seconds is given, else nothing is written.",
            show_default=False,
        ),
    ] = None,
    slopes_only: Annotated[
        bool, typer.Option("--slopes-only", help="No curve: slopes in px per view step only.")
    ] = False,
    calibration: CalibrationChoice = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="A camera that moves: go on with its newest scan, of which every view that was "
            "taken is kept.",
        ),
    ] = False,
    record: Annotated[
        Path | None,
        typer.Option(
            "--record",
            metavar="FILE.mcap",
            help="Record all multi-views and their depth into this new file; a profile with "
            'camera.kind = "recording" plays it back.',
            show_default=False,
        ),
    ] = None,
    record_as: RecordAs = None,
    points: Points = False,
    serve: Serve = None,
    serve_host: ServeHost = None,
    serve_port: ServePort = None,
    temporal: TemporalFrames = None,
    roi: RegionOfInterest = None,
    fill: FillHoles = None,
    decimate: Decimation = None,
    view: View = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    note: Note = "",
    tags: Tags = None,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Measure depth live with the calibrated curve of this rig.

    Where no sweep was made, the rig's calibration or the device's own gives one, and that is said.

    Writes per multi-view slope, depth and sigma as PFM (px per view step, mm), depth as a 16-bit
    PNG in mm, labels, and one line in frames.jsonl. Depth counts from the optical centre of the
    reference camera along its axis. Ctrl-C ends an endless capture.
    """
    if slopes_only and curve_id is not None:
        raise typer.BadParameter("--slopes-only uses no --curve")
    require_consistent(
        is_recorded=record is not None,
        record_as=record_as,
        serve=serve,
        where=serve_host is not None or serve_port is not None,
        points=points,
    )
    page = page_request(view_host, view_port, is_wanted=view)
    from rig.capture.capture import CaptureRequest
    from rig.capture.on_rig import capture_on_rig
    from rig.cli.output import show_json, tell
    from rig.cli.progress import ProgressLine
    from rig.profile.load import load_profile
    from rig.stored import RunChoice, curve_choice

    processing = processing_overrides(temporal, roi, fill, decimate)
    profile = load_profile(profile_name, [*(overrides or ()), *processing])
    choice = RunChoice(database, calibration, curve_choice(curve_id, slopes_only=slopes_only))
    request = CaptureRequest(
        frames=frames,
        duration_s=seconds,
        folder=out,
        recording=record,
        recorded_as=record_as or "foxglove",
        points=points,
        note=note,
        tags=tuple(tags or ()),
        resume=resume,
        outputs=served(serve, serve_host, serve_port, points=points),
    )
    with ProgressLine(frames) as progress:
        more = capture_page(page, progress.tell)
        summary = capture_on_rig(profile, choice, request, progress.report, progress.tell, more)
    if as_json:
        show_json(_as_dict(summary))
    else:
        _show(summary)
    if summary.failure is not None:
        raise summary.failure
    if summary.is_interrupted:
        tell(f"rig: interrupted; {saved(summary)}")
        raise typer.Exit(130)
    if summary.failed_gate is not None:
        tell(f"rig: quality gate missed: {summary.failed_gate}")
        tell_next("capture, gate", as_json=as_json, profile=profile_name)
        raise typer.Exit(3)
    tell_next("capture", as_json=as_json, profile=profile_name)


def _as_dict(summary: "CaptureSummary") -> dict[str, object]:
    latency_s, skew_s = summary.latency_s, summary.skew_s
    by_output = {output.name: output.dropped for output in summary.outputs}
    return {
        "frames": summary.frames,
        "curve": None if summary.curve is None else summary.curve.as_dict(),
        "fps": summary.frames_per_s,
        "fps_measuring": summary.measured_per_s,
        "waited_s": summary.waited_s,
        "latency_ms": _in_ms(latency_s),
        "measuring_ms": _in_ms(summary.measuring_s),
        "dropped": sum(summary.dropped.values()),
        "dropped_by_reason": {**summary.dropped, **by_output},
        "outputs": {
            output.name: {
                "written": output.written,
                "dropped": output.dropped,
                "latency_ms": _in_ms(output.latency_s),
                "failed": None if output.failure is None else str(output.failure),
            }
            for output in summary.outputs
        },
        "valid_pct": summary.valid_pct,
        **precision_as_dict(summary),
        "skew_ms": {**_in_ms(skew_s), "max": 1e3 * skew_s.largest},
        "time_ns": summary.time_ns,
        "out": None if summary.folder is None else str(summary.folder),
    }


def saved(summary: "CaptureSummary") -> str:
    """Say what an interrupted capture has left."""
    kept = [f"{output.written} by {output.name}" for output in summary.outputs if output.is_kept]
    where = f", kept {' and '.join(kept)}" if kept else ""
    return f"{summary.frames} multi-views were measured{where}"


def _in_ms(spread: "Spread") -> dict[str, float]:
    return {"p50": 1e3 * spread.median, "p95": 1e3 * spread.p95}


def _show(summary: "CaptureSummary") -> None:
    from rig.cli.output import show

    what = "slopes" if summary.curve is None else f"depth ({summary.curve.in_words})"
    whom = "simulated camera" if summary.is_simulated else "camera"
    show(
        f"{summary.frames} multi-views, {what}: {summary.frames_per_s:.1f} per s, "
        f"{summary.measured_per_s:.1f} without waiting for the {whom}"
    )
    show(
        f"latency from mid-exposure {_in_words(summary.latency_s)}, "
        f"of which measuring {1e3 * summary.measuring_s.median:.0f} ms"
    )
    lost = ", ".join(f"{count} {reason}" for reason, count in summary.dropped.items() if count)
    show(
        f"answer at {summary.valid_pct:.1f} % of the pixels; "
        f"skew at most {1e3 * summary.skew_s.largest:.2f} ms; dropped: {lost or 'none'}"
    )
    show(precision_in_words(summary))
    for output in summary.outputs:
        state = "" if output.failure is None else "; failed, see below"
        show(
            f"{output.name}: {output.written} taken, {output.dropped} dropped, "
            f"latency {_in_words(output.latency_s)}{state}"
        )
    if summary.folder is not None:
        show(f"maps in {summary.folder}; a picture of the last one: {summary.picture or 'none'}")


def _in_words(spread: "Spread") -> str:
    return f"{1e3 * spread.median:.0f} ms median, {1e3 * spread.p95:.0f} ms 95th percentile"
