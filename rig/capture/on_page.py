"""The live page among the outputs of a capture."""

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rig.capture.asked_for import AskedFor
from rig.capture.capture import CaptureRequest
from rig.capture.output import Output, WantedOutput
from rig.live.camera import DepthCamera
from rig.progress import Tell
from rig.view.actions import Recording, Refusal
from rig.view.live_view import LiveView, serve_capture

_TOKEN_BYTES = 16


@dataclass(frozen=True, slots=True)
class PageRequest:
    """A live page that a person wants to see."""

    host: str = "127.0.0.1"
    """Where it is served; only this machine reaches the default."""
    port: int = 0
    """0: any free one."""


def page_outputs(
    page: PageRequest,
    request: CaptureRequest,
    folder: Path,
    tell: Tell,
    show: Callable[[str], object],
) -> tuple[WantedOutput, ...]:
    """Return the page, and the output that keeps what is asked for on it.

    Args:
        page: where it is served.
        request: of the capture: what it writes anyway is not written once more.
        folder: where frames and recordings go that are asked for.
        tell: told what happens at the page, one line each.
        show: given the address once it is served, e.g. to open a browser.

    Both raise ConfigError as they are opened if the page cannot be served there.
    """
    asked: list[AskedFor] = []

    def keep(camera: DepthCamera) -> Output:
        asked.append(AskedFor(folder, camera))
        return asked[0]

    def view(camera: DepthCamera) -> Output:
        (kept,) = asked
        server = serve_capture(
            page.host,
            page.port,
            secrets.token_urlsafe(_TOKEN_BYTES),
            tell,
            kept.save
            if request.folder is None
            else Refusal(f"every frame is written into {folder} already"),
            Recording(kept.start_recording, kept.stop_recording, lambda: kept.is_recording)
            if request.recording is None
            else Refusal(f"everything is recorded into {request.recording} already"),
        )
        tell(f"rig: live page: {server.url}")
        show(server.url)
        return LiveView(camera.run, lambda: camera.dropped, server)

    return WantedOutput(keep, is_kept=True), WantedOutput(view, is_kept=False)
