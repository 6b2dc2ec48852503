"""What somebody who watches a sweep is told, as it happens."""

from collections.abc import Mapping
from typing import Protocol

from rig.measurement import Measurement
from rig.records import SampleKey
from rig.sweep.conclude import SweepResult
from rig.sweep.job import SweepJob
from rig.sweep.take import NewSample


class SweepWatcher(Protocol):
    """Is told after everything is stored, on the thread of the sweep: it must be quick."""

    def begins(self, job: SweepJob, done: int) -> None:
        """A sweep begins, or goes on after `done` samples."""
        ...

    def took(self, new: NewSample, key: SampleKey) -> None:
        """One more sample is stored."""
        ...

    def measured(self, measurements: Mapping[SampleKey, Measurement]) -> None:
        """These samples are measured; often none."""
        ...

    def concluded(self, result: SweepResult) -> None:
        """The curve is fitted and judged."""
        ...


class Unwatched:
    """Nobody watches."""

    def begins(self, job: SweepJob, done: int) -> None:
        """Do nothing."""

    def took(self, new: NewSample, key: SampleKey) -> None:
        """Do nothing."""

    def measured(self, measurements: Mapping[SampleKey, Measurement]) -> None:
        """Do nothing."""

    def concluded(self, result: SweepResult) -> None:
        """Do nothing."""
