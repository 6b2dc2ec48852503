"""`rig sim`: simulated devices for other programs."""

from enum import StrEnum
from typing import Annotated

import typer

from rig.cli.options import AsJson
from rig.cli.output import show, show_json, tell

INTERRUPTED = 130

app = typer.Typer(help="Simulated devices for other programs.", no_args_is_help=True)


class StageProtocol(StrEnum):
    """Serial protocols that the simulated stage speaks."""

    GRBL = "grbl"


@app.callback()
def _sim() -> None:
    """Simulated devices for other programs."""


@app.command()
def stage(
    *,
    protocol: Annotated[
        StageProtocol, typer.Option(help="What the stage speaks.")
    ] = StageProtocol.GRBL,
    as_json: AsJson = False,
) -> None:
    """Offer the simulated stage on a serial port (a pty) until Ctrl-C.

    Opening the port resets the controller, as on a real board; home it first ($H).
    """
    from rig.hardware import serve_simulated_stage

    def announce(port: str) -> None:
        if as_json:
            show_json({"protocol": protocol.value, "port": port, "baud": 115200})
        else:
            show(port)
            tell(f"a {protocol.value} stage answers at {port}, 115200 baud; Ctrl-C ends it")
        typer.get_text_stream("stdout").flush()

    try:
        serve_simulated_stage(announce)
    except KeyboardInterrupt:
        tell("the simulated stage is gone")
        raise typer.Exit(INTERRUPTED) from None
