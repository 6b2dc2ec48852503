"""Options that several verbs share."""

from typing import Annotated

import typer

ProfileName = Annotated[
    str,
    typer.Argument(
        metavar="PROFILE", help="Name of a profile (`rig profile list`) or a path to a TOML file."
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY.PATH=VALUE",
        help="Override one value of the profile; may be given again.",
        show_default=False,
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
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
