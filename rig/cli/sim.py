"""`rig sim`: simulated devices for other programs."""

import sys
from typing import Annotated

import typer

from rig.cli.choices import one_of
from rig.cli.options import AsJson, Overrides
from rig.cli.output import show, show_json, tell
from rig.cli.way_out import INTERRUPTED

app = typer.Typer(help="Simulated devices for other programs.", no_args_is_help=True)


def _protocols() -> tuple[str, ...]:
    from rig.hardware.opening import simulated_protocols

    return simulated_protocols()


@app.callback()
def _sim() -> None:
    """Simulated devices for other programs."""


@app.command()
def stage(
    profile_name: Annotated[
        str, typer.Argument(metavar="[PROFILE]", help="Simulated rig whose stage it is.")
    ] = "sim",
    *,
    protocol: Annotated[
        str,
        typer.Option(
            parser=one_of(_protocols),
            autocompletion=_protocols,
            metavar="PROTOCOL",
            help="What the stage speaks; a wrong word lists all.",
        ),
    ] = "grbl",
    tcp: Annotated[
        int | None,
        typer.Option(
            metavar="PORT",
            min=0,
            max=65535,
            help="Offer it on this TCP port of 127.0.0.1 instead of a pty; 0 takes a free one.",
        ),
    ] = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Offer the simulated stage on a serial port (a pty) or TCP port until Ctrl-C.

    Opening the port resets a GRBL or Marlin controller, as on a real board; home it first
    (GRBL $H, Zaber /1 1 home, Marlin G28 X).
    """
    from rig.hardware.opening import serve_simulated_stage
    from rig.interrupts import Interrupts
    from rig.profile.load import load_profile

    profile = load_profile(profile_name, overrides or ())

    def announce(port: str) -> None:
        if as_json:
            show_json({"protocol": protocol, "port": port, "baud": 115200})
        else:
            show(port)
            tell(f"a {protocol} stage answers at {port}, 115200 baud; Ctrl-C ends it")
        sys.stdout.flush()

    try:
        with Interrupts():  # a shell that starts it in the background hands Ctrl-C down ignored
            serve_simulated_stage(profile, protocol, announce, tcp_port=tcp)
    except KeyboardInterrupt:
        tell("the simulated stage is gone")
        raise typer.Exit(INTERRUPTED) from None
