"""Options of the live page, for the verbs that have one."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rig.capture.capture import CaptureRequest
    from rig.capture.output import WantedOutput

ViewHost = Annotated[
    str | None,
    typer.Option(
        "--view-host",
        metavar="ADDRESS",
        help="Serve the page at this address of this machine, e.g. 0.0.0.0 for all; whoever "
        "has the printed address sees what the cameras see. Default: for this machine only.",
        show_default=False,
    ),
]
ViewPort = Annotated[
    int | None,
    typer.Option(
        "--view-port",
        min=0,
        max=65535,
        help="Serve the page at this port; default: any free one.",
        show_default=False,
    ),
]


def page_of(
    host: str | None, port: int | None, *, is_wanted: bool
) -> "Callable[[CaptureRequest, Path], tuple[WantedOutput, ...]]":
    """Return what makes the page of a capture as the options ask for it."""
    if not is_wanted:
        if host is not None or port is not None:
            raise typer.BadParameter("--view-host and --view-port belong to --view")
        return lambda *_: ()
    from rig.capture.on_page import PageRequest, page_outputs
    from rig.cli.output import tell
    from rig.view.browser import open_browser

    default = PageRequest()
    page = PageRequest(host or default.host, default.port if port is None else port)
    return lambda request, folder: page_outputs(page, request, folder, tell, open_browser)
