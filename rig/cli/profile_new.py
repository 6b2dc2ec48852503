"""`rig profile new`: a commented profile from what is plugged in, or from another profile."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rig.cli.output import show, tell


class NewCamera(StrEnum):
    """Kinds of cameras that a new profile can have."""

    V4L2 = "v4l2"
    OAK = "oak"


class NewStage(StrEnum):
    """Kinds of stages that a new profile can have."""

    GRBL = "grbl"
    ZABER = "zaber"
    MARLIN = "marlin"
    NONE = "none"


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
        NewCamera | None, typer.Option(help="Kind of camera.", show_default="what is there")
    ] = None,
    views: Annotated[
        int | None,
        typer.Option(min=2, max=5, help="How many views.", show_default="what is there"),
    ] = None,
    stage: Annotated[
        NewStage | None,
        typer.Option(help="What the stage speaks.", show_default="by its adapter, else grbl"),
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
    from rig.profile.plugged import recipe_for
    from rig.profile.template import profile_text

    path = out if out is not None else Path("calib_profiles") / f"{name}.toml"
    if start is not None:
        if camera or views or stage:
            raise typer.BadParameter("--from stands alone, without --camera, --views, --stage")
        text = copied_text(start, name)
    else:
        from rig.hardware.find import find_devices

        recipe = recipe_for(
            name,
            find_devices(timeout_s=5.0),
            camera=None if camera is None else camera.value,
            views=views,
            stage=None if stage in (None, NewStage.NONE) else stage.value,
            has_stage=stage is not NewStage.NONE,
        )
        text = profile_text(recipe)
    write_new(path, text)
    profile = load_profile(str(path))
    show(str(path))
    stage_kind = "no stage" if profile.stage is None else f"stage {profile.stage.kind}"
    tell(
        f"{len(profile.views)} views, camera {profile.camera.kind}, {stage_kind}; settle the lines "
        f"that say MEASURE, then: rig check {path if out else name} --no-move"
    )
