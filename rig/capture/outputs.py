"""All outputs of one capture, side by side."""

from collections.abc import Iterable

from rig.capture.output import WantedOutput
from rig.capture.output_thread import PATIENCE_S, OutputSummary, OutputThread
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.progress import Tell

_KEPT_ROOM = 8
"""Frames that may wait for files: what a disk needs when it stalls for a moment."""
_SHOWN_PATIENCE_S = 3.0


class Outputs:
    """Hands every frame to every output that still takes them.

    Args:
        threads: of the outputs.
        tell: told once of every output that ends before the capture does.
    """

    def __init__(self, threads: Iterable[OutputThread], tell: Tell) -> None:
        self._threads = tuple(threads)
        self._tell = tell
        self._told: set[str] = set()
        self.summaries: tuple[OutputSummary, ...] = ()
        """What they did; empty until `finish` has ended."""

    @property
    def take_frames(self) -> bool:
        """Whether any takes frames: False once all outputs have failed, True without any."""
        return not self._threads or any(thread.failure is None for thread in self._threads)

    def offer(self, frame: DepthFrame) -> None:
        """Queue one frame everywhere."""
        for thread in self._threads:
            thread.offer(frame)
        self._tell_failures("the capture goes on without it")

    def finish(self) -> None:
        """Let all take what waits for them, and close them."""
        for thread in self._threads:
            thread.end()
        for thread in self._threads:  # all of them, before a mistake in one is raised
            thread.wait()
        self.summaries = tuple(thread.finish() for thread in self._threads)
        self._tell_failures("it is not whole")

    def _tell_failures(self, then: str) -> None:
        for thread in self._threads:
            if thread.failure is not None and thread.name not in self._told:
                self._told.add(thread.name)
                self._tell(f"rig: {thread.name}: {thread.failure}; {then}")


def open_outputs(
    camera: DepthCamera, wanted: Iterable[WantedOutput], *, waits: bool, tell: Tell
) -> Outputs:
    """Open outputs, each on its own thread; where one cannot be opened, none is.

    Args:
        camera: open.
        wanted: in the order in which they are opened.
        waits: whether outputs that keep are waited for, because the camera can wait.
        tell: see `Outputs`.

    Raises:
        RigError: one cannot be opened.
    """
    threads: list[OutputThread] = []
    try:
        for one in wanted:
            thread = OutputThread(
                one.open(camera),
                is_kept=one.is_kept,
                room=_KEPT_ROOM if one.is_kept else 1,
                waits=waits and one.is_kept,
                patience_s=PATIENCE_S if one.is_kept else _SHOWN_PATIENCE_S,
            )
            threads.append(thread)
    except BaseException:
        Outputs(threads, tell).finish()
        raise
    return Outputs(threads, tell)
