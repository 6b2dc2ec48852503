"""The command line: each verb parses, calls and prints; nothing is decided here."""

import sys
from typing import Annotated

import typer

from rig import __version__
from rig.cli import profile, sim
from rig.cli.calibrate import calibrate
from rig.cli.capture import capture
from rig.cli.check import check
from rig.cli.compare import compare
from rig.cli.devices import devices
from rig.cli.export import export
from rig.cli.fit import fit
from rig.cli.history import history
from rig.cli.import_calibration import import_calibration
from rig.cli.report import report
from rig.cli.sweep import sweep
from rig.cli.target import target
from rig.errors import RigError

app = typer.Typer(
    name="rig",
    help="Turn a multi-view camera into a calibrated depth camera.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help wraps paragraphs, and starts twice as fast
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(devices)
app.command()(check)
app.command()(target)
app.command()(calibrate)
app.command()(sweep)
app.command()(capture)
app.command()(compare)
app.command()(fit)
app.command()(report)
app.command()(history)
app.command()(export)
app.command("import")(import_calibration)
app.add_typer(profile.app, name="profile")
app.add_typer(sim.app, name="sim")


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"rig {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Turn a multi-view camera into a calibrated depth camera."""


def main() -> None:
    """Run the program; our own errors become one line and exit code 1."""
    try:
        app()
    except RigError as error:
        line = " ".join(str(error).split())
        sys.stderr.write(f"rig: {line}\n")
        raise SystemExit(1) from error
