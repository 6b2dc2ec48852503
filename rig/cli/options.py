"""Options that several verbs share, and what a value must be before a verb begins."""

import math
from typing import Annotated

import typer

from rig.cli.words import (
    calibration_choices,
    curve_numbers,
    profile_names,
    sweep_numbers,
)

MOST_FRAMES = 1_000_000


def finite(value: float | None) -> float | None:
    """Refuse nan and infinity, which every bound lets through."""
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is no length, time or number of anything")
    return value


def _key_and_value(given: list[str] | None) -> list[str] | None:
    for text in given or ():
        key, equals, _ = text.partition("=")
        if not equals or not all(part.strip() for part in key.split(".")):
            raise typer.BadParameter(f"{text!r}: write it as key.path=value")
    return given


def _number_or_none(given: str | None) -> str | None:
    if given in (None, "none") or (given.isdecimal() and int(given) > 0):
        return given
    raise typer.BadParameter(f"{given!r} is neither the number of a calibration nor none")


def _is_url(given: str | None) -> str | None:
    if given and "://" not in given:  # not shown: it may hold a password
        raise typer.BadParameter(
            "no URL; for a file write sqlite:///relative.sqlite or sqlite:////absolute/path.sqlite"
        )
    return given


ProfileName = Annotated[
    str,
    typer.Argument(
        metavar="PROFILE",
        help="Name of a profile (`rig profile list`) or a path to a TOML file.",
        autocompletion=profile_names,
    ),
]
MaybeProfileName = Annotated[
    str | None,
    typer.Argument(
        metavar="PROFILE",
        help="Name of a profile (`rig profile list`) or a path to a TOML file.",
        autocompletion=profile_names,
        show_default=False,
    ),
]
SweepNumber = Annotated[
    int,
    typer.Argument(
        metavar="SWEEP",
        min=1,
        help="Number of the sweep; `rig history` shows them.",
        autocompletion=sweep_numbers,
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY.PATH=VALUE",
        help="Override one value of the profile; may be given again.",
        show_default=False,
        callback=_key_and_value,
    ),
]
DatabaseUrl = Annotated[
    str | None,
    typer.Option(
        "--db",
        metavar="URL",
        envvar="RIG_DATABASE",
        help="SQLAlchemy URL, e.g. sqlite:///bench.sqlite; default: a file in the user's "
        "data directory.",
        show_default=False,
        callback=_is_url,
    ),
]
CurveNumber = Annotated[
    int | None,
    typer.Option(
        "--curve",
        metavar="ID",
        min=1,
        help="Use this curve, not the newest good one of the rig.",
        autocompletion=curve_numbers,
    ),
]
CalibrationChoice = Annotated[
    str | None,
    typer.Option(
        "--calibration",
        metavar="ID|none",
        help="Rectify with this geometric calibration, or take pictures as they are; default: the "
        "newest good calibration of the rig, if there is one.",
        show_default=False,
        callback=_number_or_none,
        autocompletion=calibration_choices,
    ),
]
CalibrationAgain = Annotated[
    str | None,
    typer.Option(
        "--calibration",
        metavar="ID|none",
        help="Measure with this geometric calibration, or with none; default: as before.",
        show_default=False,
        callback=_number_or_none,
        autocompletion=calibration_choices,
    ),
]
Note = Annotated[
    str,
    typer.Option("--note", metavar="TEXT", help="Words to be kept with it.", show_default=False),
]
Tags = Annotated[
    list[str] | None,
    typer.Option(
        "--tag",
        metavar="WORD",
        help="Word to find it again by (`rig history --tag`); may be given again.",
        show_default=False,
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
