"""A sign of life, again and again, on a thread of its own."""

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Self

from rig.errors import StoreError


class Heartbeat:
    """Calls `beat` at once every so often, until the block ends or `beat` says that it is over.

    Args:
        beat: gives a sign of life; returns whether that was of any use. Where the database cannot
            be reached the next one is waited for.
        every_s: pause between two.
    """

    def __init__(self, beat: Callable[[], bool], every_s: float) -> None:
        self._beat = beat
        self._every_s = every_s
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="heartbeat", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(self._every_s):
            with suppress(StoreError):
                if not self._beat():
                    return
