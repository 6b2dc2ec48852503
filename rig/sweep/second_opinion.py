"""What calibrated cameras see, beside what a hand has read: a misread ruler shows at once."""

from collections.abc import Mapping

from rig.measurement import Measurement
from rig.optics.calibrated import CalibratedOptics
from rig.progress import Tell
from rig.records import SampleKey
from rig.sweep.calibration_use import seen_mm
from rig.sweep.conclude import SweepResult
from rig.sweep.job import SweepJob
from rig.sweep.points import axis_slopes_px
from rig.sweep.take import NewSample
from rig.sweep.watch import SweepWatcher, Unwatched

MISREAD = 4.0
"""A reading so many of its sigmas away from what the cameras see is doubted. The calibration has an
uncertainty of its own, so nothing is refused."""


class SecondOpinion:
    """Tells where the cameras see the board, once a stop; keeps `SweepWatcher`.

    Only where distances are read by a person and the cameras are calibrated: the sweep itself takes
    the reading, because a curve is proven by what the cameras do not know.

    Args:
        tell: hears of it.
        watcher: is told everything as well.
    """

    def __init__(self, tell: Tell, watcher: SweepWatcher | None = None) -> None:
        self._tell = tell
        self._watcher = watcher or Unwatched()
        self._optics: CalibratedOptics | None = None
        self._sigma_mm = 0.0
        self._read_mm: dict[int, float] = {}
        self._told: set[int] = set()

    def begins(self, job: SweepJob, done: int) -> None:
        """See `SweepWatcher.begins`."""
        stage, optics = job.run.profile.stage, job.run.optics
        self._sigma_mm = 0.0 if stage is None else stage.distance_sigma_mm
        is_read = self._sigma_mm > 0.0
        self._optics = optics if is_read and isinstance(optics, CalibratedOptics) else None
        self._watcher.begins(job, done)

    def took(self, new: NewSample, key: SampleKey) -> None:
        """See `SweepWatcher.took`."""
        self._read_mm.setdefault(new.stop.index, new.reached_mm)
        self._watcher.took(new, key)

    def measured(self, measurements: Mapping[SampleKey, Measurement]) -> None:
        """See `SweepWatcher.measured`."""
        for (stop, _), measurement in measurements.items():
            read_mm = self._read_mm.get(stop)
            if self._optics is not None and read_mm is not None and stop not in self._told:
                self._compare(self._optics, stop, read_mm, measurement)
        self._watcher.measured(measurements)

    def concluded(self, result: SweepResult) -> None:
        """See `SweepWatcher.concluded`."""
        self._watcher.concluded(result)

    def _compare(
        self, optics: CalibratedOptics, stop: int, read_mm: float, measurement: Measurement
    ) -> None:
        for slope_px in axis_slopes_px(
            [measurement], optics
        ):  # none where it could not be measured
            self._told.add(stop)
            known_mm = optics.distance_mm(read_mm)
            off_mm = float(seen_mm(optics, slope_px)) - known_mm
            line = (
                f"read {read_mm:.1f} mm, the calibrated cameras see the board {abs(off_mm):.1f} mm "
                f"{'farther' if off_mm > 0.0 else 'nearer'}"
            )
            if abs(off_mm) > MISREAD * self._sigma_mm:
                line += (
                    f": more than {MISREAD:g} times reading_sigma_mm; was it misread? (Ctrl-C, "
                    "then begin a new sweep, or see whether the calibration is of these cameras)"
                )
            self._tell(line)
