"""Outputs that do as they are told, and frames for them."""

import threading
from dataclasses import replace
from functools import cache

from rig.errors import RigError
from rig.live.frame import DepthFrame
from tests.unit.live.devices import tiny_rig


@cache
def one_frame() -> DepthFrame:
    with tiny_rig()[0] as camera:
        return camera.grab()


def frames(count: int) -> list[DepthFrame]:
    """So many frames that differ in their number only."""
    return [replace(one_frame(), index=index) for index in range(count)]


class ScriptedOutput:
    """Takes frames; stops at its gate, raises, or both, when it is told to.

    Args:
        name: of the output.
        error: raised by the write of a frame of number `fails_at`, or by `close`.
        fails_at: number of a frame, or `close`.
        is_open: whether frames pass the gate from the beginning.
    """

    def __init__(
        self,
        name: str = "files",
        *,
        error: BaseException | None = None,
        fails_at: int | str | None = None,
        is_open: bool = True,
    ) -> None:
        self.name = name
        self.taken: list[int] = []
        self.closed = 0
        self.began = threading.Semaphore(0)
        """One for every frame whose write has begun."""
        self.gate = threading.Event()
        self._error = error or RigError("the disk is full", advice="make room")
        self._fails_at = fails_at
        if is_open:
            self.gate.set()

    def write(self, frame: DepthFrame) -> None:
        self.began.release()
        assert self.gate.wait(60.0)
        if frame.index == self._fails_at:
            raise self._error
        self.taken.append(frame.index)

    def close(self) -> None:
        self.closed += 1
        if self._fails_at == "close":
            raise self._error
