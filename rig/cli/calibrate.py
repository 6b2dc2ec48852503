"""`rig calibrate`: cameras, their places, the target and the stage, in one solve."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.calibration_result import calibration_as_dict, calibration_lines
from rig.cli.from_scene import SceneChoices, from_scenes, refuse_others
from rig.cli.lenslet_result import lenslet_lines, lenslets_as_dict
from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl, Note, Overrides, ProfileName, Tags, finite
from rig.cli.output import show, show_json, tell
from rig.cli.page_options import View, ViewHost, ViewPort, calibrate_page, page_request
from rig.cli.words import calibration_numbers

if TYPE_CHECKING:
    from rig.calibrate.conclude import CalibrationResult


class LensChoice(StrEnum):
    """Lens models."""

    AUTO = "auto"
    BROWN5 = "brown5"
    BROWN8 = "brown8"
    FISHEYE = "fisheye"
    NONE = "none"


class Fix(StrEnum):
    """What of a start is kept."""

    NONE = "none"
    INTRINSICS = "intrinsics"
    ALL = "all"


def calibrate(
    profile_name: ProfileName,
    *,
    stage: Annotated[
        bool,
        typer.Option(
            "--stage",
            help="First let the stage carry the target through known positions: its axis, scale "
            "and zero are solved with the cameras.",
        ),
    ] = False,
    frames: Annotated[
        list[str] | None,
        typer.Option(
            "--frames",
            metavar="DIR | VIEW=PATTERN",
            help="Stored pictures or videos instead of the camera: a folder that names the views, "
            "or one pattern or video per view.",
            show_default=False,
        ),
    ] = None,
    white: Annotated[
        Path | None,
        typer.Option(
            "--white",
            metavar="FILE",
            help="Picture of an evenly lit white surface, for a camera behind lenslets.",
            show_default=False,
        ),
    ] = None,
    pictures: Annotated[
        int,
        typer.Option(
            "--pictures", min=3, max=10_000, help="Most pictures of a target in the hand."
        ),
    ] = 60,
    lens: Annotated[
        LensChoice, typer.Option("--lens", help="Model of all lenses; auto: by cross-validation.")
    ] = LensChoice.AUTO,
    start: Annotated[
        int | None,
        typer.Option(
            "--start",
            metavar="ID",
            min=1,
            autocompletion=calibration_numbers,
            help="Calibration to start from.",
            show_default=False,
        ),
    ] = None,
    fix: Annotated[Fix, typer.Option("--fix", help="What of --start to keep as it is.")] = Fix.NONE,
    from_scene: Annotated[
        bool,
        typer.Option(
            "--from-scene",
            help="Without a target, from ordinary scenes: how views are turned and where they "
            "stand; focal lengths and lengths are those that are known already.",
        ),
    ] = False,
    outlier_px: Annotated[
        float | None,
        typer.Option(
            "--outlier-px",
            metavar="PX",
            min=0.0,
            callback=finite,
            help="Leave out points further than this from where they should be, and solve again.",
            show_default="those beyond 5 sigma",
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the newest unfinished one of this rig.")
    ] = False,
    note: Note = "",
    tags: Tags = None,
    view: View = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Calibrate all cameras of a rig together, from pictures of its target.

    Show the target still, in many places, distances and tilts; the program says what is missing
    and stops when more would not help. Every picture is on the disk before the next is taken:
    after Ctrl-C or a crash `--resume` goes on. Ends with the depth error that the calibration
    alone causes; exit code 3 says that the calibration is weak, and why.

    With `--from-scene` no target is needed: features of ordinary scenes tell how the views are
    turned, so that rows meet; depth is as true as the focal length and the pitch that are known.

    A camera behind lenslets is calibrated by a white picture: where its micro-images lie, and how
    much light reaches their pixels. Views of one lens need no more.
    """
    from rig.calibrate.calibrate import CalibrateRequest, run_calibration
    from rig.calibrate.lenslets import calibrate_lenslets
    from rig.calibrate.solve import SolveChoices
    from rig.calibrate.stored_pictures import stored_pictures
    from rig.calibrate.take import Operator
    from rig.cli.progress import ProgressLine
    from rig.database import open_store
    from rig.interrupts import Interrupts
    from rig.profile.load import load_profile
    from rig.stored import stored_rig

    if fix is not Fix.NONE and start is None:
        raise typer.BadParameter(f"--fix {fix.value}: give the calibration with --start")
    if outlier_px == 0:
        raise typer.BadParameter("--outlier-px 0 leaves no point: give a distance in px")
    page = page_request(view_host, view_port, is_wanted=view)
    profile = load_profile(profile_name, overrides or ())
    if white is not None or profile.camera.kind == "lenslet":
        with open_store(database) as store:
            found = calibrate_lenslets(profile, store, tell, white)
        if as_json:
            show_json(lenslets_as_dict(found))
        else:
            for line in lenslet_lines(found):
                show(line)
        return
    if frames:
        profile = stored_pictures(profile, frames, Path.cwd())
    if from_scene:
        refuse_others(stage=stage, resume=resume, fix=fix is not Fix.NONE)
        with open_store(database) as store:
            from_scenes(
                store,
                SceneChoices(
                    profile,
                    profile_name,
                    start,
                    lens.value,
                    pictures,
                    note,
                    tuple(tags or ()),
                ),
                as_json=as_json,
            )
        return
    with open_store(database) as store:
        begin = None if start is None else stored_rig(store, start).geometry
        request = CalibrateRequest(
            profile,
            SolveChoices(lens.value, begin, fix.value, outlier_px),
            most_pictures=pictures,
            on_stage=stage,
            resume=resume,
            note=note,
            tags=tuple(tags or ()),
        )
        with (
            Interrupts() as interrupts,
            ProgressLine(None) as progress,
            calibrate_page(page, progress.tell) as watch,
        ):
            operator = Operator(interrupts, progress.report, tell, watch)
            result = run_calibration(request, store, operator)
    _conclude(result, profile_name, one_camera=len(profile.views) == 1, as_json=as_json)


def _conclude(
    result: "CalibrationResult", profile_name: str, *, one_camera: bool, as_json: bool
) -> None:
    """Print the result and the next verb; exit code 3 says that it is weak."""
    if as_json:
        show_json(calibration_as_dict(result))
    else:
        for line in calibration_lines(result):
            show(line)
    if not result.calibration.verdict.good:
        tell(
            "rig: weak calibration"
            if one_camera
            else f"rig: weak calibration; sweeps and captures take it only on purpose: "
            f"--calibration {result.calibration_id}"
        )
        tell_next("calibrate, weak", as_json=as_json, profile=profile_name)
        raise typer.Exit(3)
    after = "calibrate, one camera" if one_camera else "calibrate"
    tell_next(after, as_json=as_json, profile=profile_name)
