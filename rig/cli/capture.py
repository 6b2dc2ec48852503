"""`rig capture`: live metric depth."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.options import (
    MOST_FRAMES,
    AsJson,
    CalibrationChoice,
    CurveNumber,
    DatabaseUrl,
    Overrides,
    ProfileName,
    finite,
)

if TYPE_CHECKING:
    from rig.capture.run import CaptureSummary


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
    record: Annotated[
        Path | None,
        typer.Option(
            "--record",
            metavar="FILE.mcap",
            help="Record all multi-views into this new file; a profile with "
            'camera.kind = "recording" plays it back.',
            show_default=False,
        ),
    ] = None,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Measure depth live with the calibrated curve of this rig.

    Writes per multi-view slope, depth and sigma as PFM (px per view step, mm), depth as a 16-bit
    PNG in mm, labels, and one line in frames.jsonl. Depth counts from the optical centre of the
    reference camera along its axis. Ctrl-C ends an endless capture.
    """
    from rig.capture.run import CaptureRequest, capture_depth
    from rig.cli.output import show_json, tell
    from rig.cli.progress import FrameProgress
    from rig.cli.stored import find_curve, find_rectifier, new_folder
    from rig.hardware.opening import open_camera
    from rig.profile.load import load_profile

    profile = load_profile(profile_name, overrides or ())
    rectifier = find_rectifier(profile, calibration, database)
    curve = None if slopes_only else find_curve(rectifier, curve_id, database)
    if out is None and (frames is not None or seconds is not None):
        out = new_folder(database, "captures", profile.name)
    request = CaptureRequest(frames=frames, duration_s=seconds, folder=out, recording=record)
    with open_camera(profile) as (camera, _), FrameProgress(frames) as progress:
        summary = capture_depth(rectifier, request, camera, curve, on_frame=progress.update)
    if as_json:
        show_json(summary.as_dict())
    else:
        _show(summary, None if curve is None else curve[0])
    if summary.is_interrupted:
        raise typer.Exit(130)
    if summary.failed_gate is not None:
        tell(f"rig: quality gate missed: {summary.failed_gate}")
        raise typer.Exit(3)


def _show(summary: "CaptureSummary", curve_id: int | None) -> None:
    from rig.cli.output import show

    what = "slopes" if curve_id is None else f"depth (curve {curve_id})"
    show(
        f"{summary.frames} multi-views, {what}: {summary.frames_per_s:.1f} per s, "
        f"latency {1e3 * summary.latency_s[0]:.0f} ms median, "
        f"{1e3 * summary.latency_s[1]:.0f} ms 95th percentile"
    )
    lost = ", ".join(f"{count} {reason}" for reason, count in summary.dropped.items() if count)
    show(
        f"answer at {summary.valid_pct:.1f} % of the pixels; "
        f"skew at most {1e3 * summary.skew_s[2]:.2f} ms; dropped: {lost or 'none'}"
    )
    if summary.folder is not None:
        show(f"maps in {summary.folder}; a picture of the last one: {summary.picture}")
