"""Measuring beside the motion: one worker thread turns samples into slopes."""

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Self

from rig.frames import Pictures
from rig.measurement import Measurement
from rig.records import SampleKey
from rig.stored import Run
from rig.sweep.measure_sample import measure_sample


class MeasuringThread:
    """Takes samples, gives measurements back in the same order.

    One thread, because the dense estimator uses every core itself. Leaving the block drops what
    has not begun: its frames are stored, and `rig sweep --resume` or `rig fit` measure them.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="measure")
        self._waiting: list[tuple[SampleKey, Future[Measurement]]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)

    def submit(self, key: SampleKey, images: Pictures) -> None:
        """Queue one sample."""
        future = self._pool.submit(measure_sample, self._run.profile, self._run.optics, images)
        self._waiting.append((key, future))

    def finished(self) -> dict[SampleKey, Measurement]:
        """Return what has been measured since the last call, without waiting."""
        done: dict[SampleKey, Measurement] = {}
        while self._waiting and self._waiting[0][1].done():
            key, future = self._waiting.pop(0)
            done[key] = future.result()
        return done

    def remaining(self) -> Iterator[tuple[SampleKey, Measurement]]:
        """Wait for each queued sample and yield its measurement."""
        while self._waiting:
            key, future = self._waiting.pop(0)
            yield key, future.result()
