"""Slopes and curve of a sweep again, from its stored frames."""

from rig.database import Store
from rig.errors import StoreError
from rig.measurement import Measurement
from rig.progress import Progress
from rig.records import Sample, SampleKey
from rig.stored import run_of_sweep
from rig.sweep.conclude import SweepResult, conclude_sweep
from rig.sweep.measure_sample import measure_sample


def measure_again(
    store: Store, sweep_id: int, progress: Progress, calibration: str | None = None
) -> SweepResult:
    """Compute slopes and curve of a sweep again from its stored frames; no hardware is touched.

    Args:
        store: where the sweep is.
        sweep_id: its number.
        progress: told how many samples are done.
        calibration: number of the calibration to use, `none`, or None for that of the sweep.

    Raises:
        ConfigError: the calibration is of another rig.
        StoreError: no such sweep, or frames are missing.
        CurveError: the slopes make no curve.
    """
    sweep = store.sweep(sweep_id)
    samples = store.samples(sweep_id)
    _require_frames(sweep_id, samples)
    run = run_of_sweep(store, sweep, calibration)
    measured: dict[SampleKey, Measurement] = {}
    for number, sample in enumerate(samples):
        images = store.load(sample).images
        measured[sample.key] = measure_sample(run.profile, run.optics, images)
        progress(number + 1, f"{sample.stop.distance_mm:.1f} mm")
    store.replace_measurements(sweep_id, measured, calibration_id=run.optics.calibration_id)
    return conclude_sweep(store, sweep_id)


def _require_frames(sweep_id: int, samples: tuple[Sample, ...]) -> None:
    """Say at once that frames were given up; nothing of the sweep is changed.

    Raises:
        StoreError: of one sample or more.
    """
    pruned = [sample.pruned_at for sample in samples if sample.pruned_at is not None]
    if pruned:
        raise StoreError(
            f"asked to fit sweep {sweep_id}, the frames of {len(pruned)} of its {len(samples)} "
            f"samples were pruned on {max(pruned):%Y-%m-%d}",
            advice=f"its slopes and curve are kept: rig report {sweep_id}; a backup may have the "
            "frames",
        )
