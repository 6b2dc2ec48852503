"""`rig compare`: our depth beside stereo matchers."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import (
    MOST_FRAMES,
    AsJson,
    CalibrationChoice,
    CurveNumber,
    DatabaseUrl,
    Overrides,
    ProfileName,
)
from rig.cli.words import sweep_numbers

if TYPE_CHECKING:
    from rig.compare.comparison import Comparison


def compare(
    profile_name: ProfileName,
    *,
    curve_id: CurveNumber = None,
    sweep_id: Annotated[
        int | None,
        typer.Option(
            "--sweep",
            metavar="ID",
            min=1,
            autocompletion=sweep_numbers,
            help="Show the error against distance on this sweep, not on that of the curve.",
        ),
    ] = None,
    frames: Annotated[
        int,
        typer.Option("--frames", min=1, max=MOST_FRAMES, help="Compare on so many multi-views."),
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Write compare.html and compare.json into this folder; default: a new one "
            "beside the database.",
            show_default=False,
        ),
    ] = None,
    slopes_only: Annotated[
        bool, typer.Option("--slopes-only", help="No curve: slopes in px per view step only.")
    ] = False,
    calibration: CalibrationChoice = None,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Compare our depth with that of stereo matchers, on the same frames and by the same curve.

    The matchers (block matching by absolute differences, OpenCV's StereoBM and StereoSGBM) get the
    pair with the longest baseline that contains the reference view. On the board of a sweep every
    method is also compared with the distances of the stage.
    """
    if slopes_only and (curve_id is not None or sweep_id is not None):
        raise typer.BadParameter("--slopes-only uses neither --curve nor --sweep")
    from rig.cli.output import show_json
    from rig.cli.progress import ProgressLine
    from rig.compare.compare import CompareRequest, compare_on_rig
    from rig.compare.numbers import comparison_as_dict
    from rig.profile.load import load_profile
    from rig.stored import RunChoice, curve_choice

    profile = load_profile(profile_name, overrides or ())
    choice = RunChoice(database, calibration, curve_choice(curve_id, slopes_only=slopes_only))
    with ProgressLine(None) as progress:
        comparison = compare_on_rig(
            profile, choice, CompareRequest(frames, sweep_id, out), progress.report
        )
    if as_json:
        show_json(comparison_as_dict(comparison))
    else:
        _show(comparison)
    tell_next("compare", as_json=as_json, profile=profile_name)


def _show(comparison: "Comparison") -> None:
    from rig.cli.output import show, table
    from rig.compare.comparison import PAGE_FILE, distance_scores

    frames = comparison.frames
    if comparison.origin is not None:
        show(comparison.origin)
    show(
        f"{frames.count} multi-view{'s' if frames.count > 1 else ''}; matchers use the reference "
        f"view and {frames.partner}, {frames.baseline_steps:.4g} view steps apart"
    )
    rows = [
        [
            score.method,
            f"{score.density_pct:.1f}",
            f"{score.duration_ms:.1f}",
            f"{score.agreement_pct:.1f}",
            f"{score.difference_px:.3f}",
        ]
        for score in frames.scores
    ]
    header = ["method", "answers %", "time ms", "agrees with rig %", "differs by px"]
    for line in table(rows, header):
        show(line)
    if comparison.distances:
        show()
        show(f"board of sweep {comparison.sweep_id}, {len(comparison.distances)} distances")
        rows = [
            [
                score.method,
                f"{score.bias_mm:.3f}",
                f"{score.bias_pct:.3f}",
                f"{score.worst_pct:.3f}",
                f"{score.spread_mm:.3f}",
                f"{score.density_pct:.1f}",
            ]
            for score in distance_scores(comparison.distances)
        ]
        header = ["method", "error rms mm", "rms %", "largest %", "spread mm", "answers %"]
        for line in table(rows, header):
            show(line)
    if comparison.curves:
        show()
        show(f"the board by {comparison.curve_title} and by its calibration alone, error in mm")
        rows = [
            [
                f"{at.distance_mm:.1f}",
                f"{at.swept_mm:+.3f}",
                f"{at.alone_mm:+.3f}",
                f"{at.alone_k2_mm:.3f}",
            ]
            for at in comparison.curves
        ]
        for line in table(rows, ["distance mm", "with sweep", "alone", "alone k=2"]):
            show(line)
    show(f"pictures and numbers: {comparison.folder / PAGE_FILE}")
