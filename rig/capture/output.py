"""What takes the depth of a capture: files, a recording, a page, topics."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame


class Output(Protocol):
    """Takes every frame that reaches it, on a thread of its own behind a bounded queue.

    It is opened by whoever makes it, and closed once, after its last frame.
    """

    @property
    def name(self) -> str:
        """What messages and the counts of dropped frames call it, one word."""
        ...

    def write(self, frame: DepthFrame, /) -> None:
        """Take one frame; frames come in their order, some may be left out.

        Raises:
            RigError: it can take no more; the capture goes on without it, and says so.
        """
        ...

    def close(self) -> None:
        """Let go of everything; called once, also after an error of `write`.

        Raises:
            RigError: what was written before may not be whole.
        """
        ...


@dataclass(frozen=True, slots=True)
class WantedOutput:
    """An output that a capture is to have."""

    open: Callable[[DepthCamera], Output]
    """Makes it, once the camera is open: `camera.run`, `camera.views` and `camera.identity` are
    known; may raise RigError, and nothing is captured then."""
    is_kept: bool
    """Whether a person wants to have the frames afterwards (files, a recording). Then several wait
    for it, where time allows all of them are waited for, and its failure is one of the capture.
    Otherwise (a page, topics) only the newest waits, and its failure is a warning."""
