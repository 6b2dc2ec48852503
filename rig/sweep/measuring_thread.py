"""Measuring beside the motion: one worker thread turns samples into slopes."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final, Self

from rig.frames import Pictures
from rig.measurement import Measurement
from rig.records import SampleKey

MOST_HELD: Final = 4
"""So many samples wait in memory with their pictures. The pictures of all others are read back
when their turn comes: a camera that is quicker than the estimator for hours costs no memory."""


class MeasuringThread:
    """Takes samples, gives measurements back in the same order.

    One thread, because the dense estimator uses every core itself. Leaving the block drops what
    has not begun: its frames are stored, and `rig sweep --resume` or `rig fit` measure them.

    Args:
        measure: from the images (V, H, W) of one sample to its measurement.
    """

    def __init__(self, measure: Callable[[Pictures], Measurement]) -> None:
        self._measure = measure
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="measure")
        self._waiting: list[tuple[SampleKey, Future[Measurement]]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)

    def submit(self, key: SampleKey, images: Pictures, again: Callable[[], Pictures]) -> None:
        """Queue one sample.

        Args:
            key: of the sample.
            images: of all views, let go of where enough samples wait already.
            again: reads them back.
        """
        waiting = sum(not future.done() for _, future in self._waiting)
        if waiting < MOST_HELD:
            future = self._pool.submit(self._measure, images)
        else:
            future = self._pool.submit(lambda: self._measure(again()))
        self._waiting.append((key, future))

    def finished(self) -> dict[SampleKey, Measurement]:
        """Return what has been measured since the last call, without waiting.

        Raises:
            StoreError: the pictures of a sample could not be read back.
        """
        done: dict[SampleKey, Measurement] = {}
        while self._waiting and self._waiting[0][1].done():
            key, future = self._waiting.pop(0)
            done[key] = future.result()
        return done

    def remaining(self) -> Iterator[tuple[SampleKey, Measurement]]:
        """Wait for each queued sample and yield its measurement.

        Raises:
            StoreError: the pictures of a sample could not be read back.
        """
        while self._waiting:
            key, future = self._waiting.pop(0)
            yield key, future.result()
