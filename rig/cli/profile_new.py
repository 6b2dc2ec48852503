"""`rig profile new`: a commented profile from what is plugged in, or from another profile."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.choices import one_of
from rig.cli.next_verb import tell_next
from rig.cli.options import finite
from rig.cli.output import show, tell

if TYPE_CHECKING:
    from rig.profile import TargetConfig

NO_STAGE = "none"


def _cameras() -> tuple[str, ...]:
    from rig.profile.template import new_cameras

    return new_cameras()


def _stages() -> tuple[str, ...]:
    from rig.profile.template import new_stages

    return (*new_stages(), NO_STAGE)


def _layouts() -> tuple[str, ...]:
    from rig.profile.parts import layouts

    return layouts()


def new_profile(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Name of the rig: letters, digits, _, . and -.")
    ],
    *,
    start: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="PROFILE", help="Copy this profile.", show_default="what is there"
        ),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            parser=one_of(_cameras),
            autocompletion=_cameras,
            metavar="KIND",
            help="Kind of camera; a wrong word lists them.",
            show_default="what is there",
        ),
    ] = None,
    views: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=5,
            help="How many views; 1 to calibrate one camera alone.",
            show_default="what is there",
        ),
    ] = None,
    layout: Annotated[
        str | None,
        typer.Option(
            parser=one_of(_layouts),
            autocompletion=_layouts,
            metavar="LAYOUT",
            help="How the picture of one device holds all views; a wrong word lists all.",
            show_default="a picture each",
        ),
    ] = None,
    stage: Annotated[
        str | None,
        typer.Option(
            parser=one_of(_stages),
            autocompletion=_stages,
            metavar="KIND",
            help="What the stage speaks, or none; a wrong word lists all.",
            show_default="by its adapter, else the first",
        ),
    ] = None,
    target: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A target file of Kalibr (YAML): what the board is.",
            show_default="a guess to be measured",
        ),
    ] = None,
    diameter_mm: Annotated[
        float | None,
        typer.Option(
            "--diameter-mm",
            min=0.0,
            callback=finite,
            help="Of a circle, where --target describes circles.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write; one that is there is left alone.",
            show_default="calib_profiles/NAME.toml",
        ),
    ] = None,
) -> None:
    """Write a profile with comments: names of what is plugged in, guesses that say MEASURE.

    Nothing is overwritten. The profile is read back before the command ends.
    """
    from rig.profile.load import load_profile
    from rig.profile.new import copied_text, write_new
    from rig.profile.plugged import recipe_for, told_views
    from rig.profile.template import profile_text

    if diameter_mm is not None and target is None:
        raise typer.BadParameter("--diameter-mm belongs to a --target of circles")
    path = out if out is not None else Path("calib_profiles") / f"{name}.toml"
    if start is not None:
        if camera or views or stage or layout or target:
            raise typer.BadParameter(
                "--from stands alone, without --camera, --views, --layout, --stage, --target"
            )
        text = copied_text(start, name)
    else:
        from rig.hardware.find import find_devices

        board = None if target is None else _described(target, diameter_mm)
        findings = find_devices(timeout_s=5.0)
        told, notes = None, ()
        if views is None and layout is None:
            told, notes = told_views(findings, camera=camera)
        for note in notes:
            tell(note)
        recipe = recipe_for(
            name,
            findings,
            camera=camera,
            views=views,
            stage=None if stage == NO_STAGE else stage,
            has_stage=stage != NO_STAGE and (stage is not None or views != 1),
            layout=layout,
            told=told,
            notes=notes,
        )
        text = profile_text(replace(recipe, target=board))
    write_new(path, text)
    profile = load_profile(str(path))
    show(str(path))
    stage_kind = "no stage" if profile.stage is None else f"stage {profile.stage.kind}"
    count = len(profile.views)
    tell(f"{count} view{'s' if count > 1 else ''}, camera {profile.camera.kind}, {stage_kind}")
    tell_next("profile new", as_json=False, profile=path if out else name)


def _described(path: Path, diameter_mm: float | None) -> "TargetConfig":
    from rig.export.kalibr_target import read_target

    return read_target(path, diameter_mm)
