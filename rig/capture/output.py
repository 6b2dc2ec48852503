"""What takes the depth of a capture: files, a recording, a page, topics."""

from typing import Protocol

from rig.live.frame import DepthFrame


class Output(Protocol):
    """Takes every frame that reaches it, on a thread of its own behind a bounded queue.

    It is opened by whoever makes it, and closed once, after its last frame.
    """

    @property
    def name(self) -> str:
        """What messages and the counts of dropped frames call it, one word."""
        ...

    def write(self, frame: DepthFrame) -> None:
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
