"""Options of the live page, for the verbs that have one."""

from collections.abc import Callable, Generator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rig.calibrate.watch import Watch
    from rig.capture.capture import CaptureRequest
    from rig.capture.drift_log import DriftLog
    from rig.capture.output import WantedOutput
    from rig.devices import Bystander
    from rig.progress import Tell
    from rig.sweep.watch import SweepWatcher
    from rig.view.server import ViewServer
    from rig.view.serving import PageRequest

View = Annotated[bool, typer.Option("--view", help="Serve a live page; its address is printed.")]
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


def page_request(host: str | None, port: int | None, *, is_wanted: bool) -> "PageRequest | None":
    """Return the page that the options ask for; None for none."""
    if not is_wanted:
        if host is not None or port is not None:
            raise typer.BadParameter("--view-host and --view-port belong to --view")
        return None
    from rig.view.serving import PageRequest

    default = PageRequest()
    return PageRequest(host or default.host, default.port if port is None else port)


def capture_page(
    page: "PageRequest | None", tell: "Tell"
) -> "Callable[[CaptureRequest, Path, DriftLog], tuple[WantedOutput, ...]]":
    """Return what makes the page of a capture, if any."""
    if page is None:
        return lambda *_: ()
    from rig.capture.on_page import page_outputs
    from rig.view.browser import open_browser

    return lambda request, folder, log: page_outputs(page, request, folder, log, tell, open_browser)


@dataclass(frozen=True, slots=True)
class SweepPage:
    """The page of a sweep; both are None where none is served."""

    watcher: "SweepWatcher | None" = None
    bystander: "Bystander | None" = None
    """Whom a stage that is a person may ask there."""


@contextmanager
def sweep_page(page: "PageRequest | None", tell: "Tell") -> "Generator[SweepPage]":
    """Serve the page of a sweep, if any, as long as the block runs."""
    if page is None:
        yield SweepPage()
        return
    from rig.view.actions import Actions
    from rig.view.browser import open_browser
    from rig.view.hand import PageHand
    from rig.view.serving import serve_page
    from rig.view.sweep_view import SweepMessage, SweepView

    hand = PageHand()
    actions: Actions[SweepMessage] = Actions(put=hand.say)
    server = serve_page(page, tell, open_browser, actions)
    with closing(server):
        yield SweepPage(SweepView(server, hand), hand)


@contextmanager
def calibrate_page(page: "PageRequest | None", tell: "Tell") -> "Generator[Watch]":
    """Serve the page of a calibration, if any, as long as the block runs."""
    from rig.calibrate.watch import unwatched

    if page is None:
        yield unwatched
        return
    from rig.view.browser import open_browser
    from rig.view.calibrate_view import CalibrateMessage, CalibrateView
    from rig.view.serving import serve_page

    server: ViewServer[CalibrateMessage] = serve_page(page, tell, open_browser)
    with closing(server):
        yield CalibrateView(server).show
