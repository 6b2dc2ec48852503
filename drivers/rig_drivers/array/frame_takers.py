"""Threads that take the frames of several cameras as they come."""

import threading
from collections.abc import Callable, Sequence
from contextlib import suppress

from rig.devices import Camera
from rig.errors import CaptureTimeoutError
from rig.frames import MultiView


class FrameTakers:
    """One thread per camera, so that no driver is ever blocked by who uses its frames.

    Args:
        cameras: open while the threads run.
        name: of the threads.
        take: is given the number of a camera and its next multi-view, in that camera's thread.
        ended: called when the pictures of a stored camera are used up.
        failed: is given what ended a thread; no other thread is stopped by it.
    """

    def __init__(
        self,
        cameras: Sequence[Camera],
        *,
        name: str,
        take: Callable[[int, MultiView], None],
        ended: Callable[[], None],
        failed: Callable[[BaseException], None],
    ) -> None:
        self._cameras = tuple(cameras)
        self._name = name
        self._take, self._ended, self._failed = take, ended, failed
        self._stopping = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self) -> None:
        """Start all threads."""
        self._stopping.clear()
        self._threads = [
            threading.Thread(target=self._run, args=(i,), name=f"{self._name} {i}", daemon=True)
            for i in range(len(self._cameras))
        ]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """End all threads; a camera that is silent delays this by at most its own timeout."""
        self._stopping.set()
        for thread in self._threads:
            thread.join()
        self._threads.clear()

    def _run(self, index: int) -> None:
        try:
            while not self._stopping.is_set():
                with suppress(CaptureTimeoutError):  # whoever waits sees that nothing comes
                    for multiview in self._cameras[index].stream():
                        self._take(index, multiview)
                        if self._stopping.is_set():
                            return
                    self._ended()
                    return
        except BaseException as error:  # raised again where frames are asked for
            self._failed(error)
