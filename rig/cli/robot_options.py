"""Options of `rig capture` for robots and recorders, and the outputs that they ask for."""

from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.format_choice import choice_of

if TYPE_CHECKING:
    from rig.capture.output import Output, WantedOutput
    from rig.live.camera import DepthCamera

RECORDINGS = ("foxglove", "ros2")
SERVED = ("foxglove",)

RecordAs = Annotated[
    str | None,
    choice_of(
        "--as",
        RECORDINGS,
        "What the recording is: foxglove plays back as a camera, and opens in Foxglove and "
        "Lichtblick; ros2 is a bag of ROS 2.",
    ),
]
Serve = Annotated[
    str | None,
    choice_of("--serve", SERVED, "Serve live topics: foxglove for Foxglove and Lichtblick."),
]
ServeHost = Annotated[
    str | None,
    typer.Option(
        "--serve-host",
        metavar="ADDRESS",
        help="Where to serve; with any other than this computer alone, everyone in its network "
        "can look.",
        show_default="127.0.0.1",
    ),
]
ServePort = Annotated[
    int | None,
    typer.Option("--serve-port", min=0, max=65535, help="0 takes a free one.", show_default="8765"),
]
Points = Annotated[
    bool, typer.Option("--points", help="Record and serve the cloud of points as well.")
]


def require_consistent(
    *, is_recorded: bool, record_as: str | None, serve: str | None, where: bool, points: bool
) -> None:
    """Refuse options without the one that they belong to.

    Args:
        is_recorded: whether `--record` was given.
        record_as: `--as`.
        serve: `--serve`.
        where: whether `--serve-host` or `--serve-port` was given.
        points: `--points`.
    """
    if record_as is not None and not is_recorded:
        raise typer.BadParameter("--as says what --record writes: give --record FILE.mcap as well")
    if where and serve is None:
        raise typer.BadParameter("--serve-host and --serve-port go with --serve foxglove")
    if points and serve is None and not is_recorded:
        raise typer.BadParameter("--points goes with --record or --serve")


def served(
    serve: str | None, host: str | None, port: int | None, *, points: bool
) -> tuple["WantedOutput", ...]:
    """Return the outputs that `--serve` asks for; the address is told once it is open."""
    if serve is None:
        return ()
    from rig.capture.output import WantedOutput
    from rig.cli.output import tell
    from rig.robots.foxglove_server import DEFAULT_HOST, DEFAULT_PORT, FoxgloveServer

    address = host or DEFAULT_HOST

    def opened(camera: "DepthCamera") -> "Output":
        number = DEFAULT_PORT if port is None else port
        server = FoxgloveServer(camera, host=address, port=number, points=points)
        tell(f"rig: Foxglove and Lichtblick: open a connection to ws://{address}:{server.port}")
        return server

    return (WantedOutput(opened, is_kept=False),)
