"""The live page among the outputs of a capture."""

from collections.abc import Callable
from pathlib import Path

from rig.capture.asked_for import AskedFor
from rig.capture.capture import CaptureRequest
from rig.capture.drift_log import DriftLog
from rig.capture.output import Output, WantedOutput
from rig.live.camera import DepthCamera
from rig.progress import Tell
from rig.view.actions import Actions, Recording, Refusal
from rig.view.frame_message import FrameMessage
from rig.view.live_view import LiveView, capture_save
from rig.view.serving import PageRequest, serve_page


def page_outputs(
    page: PageRequest,
    request: CaptureRequest,
    folder: Path,
    log: DriftLog,
    tell: Tell,
    show: Callable[[str], object],
) -> tuple[WantedOutput, ...]:
    """Return the page, and the output that keeps what is asked for on it.

    Args:
        page: where it is served.
        request: of the capture: what it writes anyway is not written once more.
        folder: where frames and recordings go that are asked for.
        log: the looks at the cameras that the page draws.
        tell: told what happens at the page, one line each.
        show: given the address once it is served, e.g. to open a browser.

    Both raise ConfigError as they are opened if the page cannot be served there.
    """
    log.show()
    asked: list[AskedFor] = []

    def keep(camera: DepthCamera) -> Output:
        asked.append(AskedFor(folder, camera))
        return asked[0]

    def view(camera: DepthCamera) -> Output:
        (kept,) = asked
        save = (
            capture_save(kept.save)
            if request.folder is None
            else Refusal(f"every frame is written into {folder} already")
        )
        recording = (
            Recording(kept.start_recording, kept.stop_recording, lambda: kept.is_recording)
            if request.recording is None
            else Refusal(f"everything is recorded into {request.recording} already")
        )
        actions: Actions[FrameMessage] = Actions(save, recording)
        server = serve_page(page, tell, show, actions)
        return LiveView(camera.run, lambda: camera.dropped, server, drift=lambda: log.series)

    return WantedOutput(keep, is_kept=True), WantedOutput(view, is_kept=False)
