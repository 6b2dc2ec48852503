"""One sweep from its request to its result: new, resumed, or measured again."""

import statistics
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from rig.calibrations import calibration_of, chosen_calibration
from rig.database import Measurement, SampleKey, Store, software_versions
from rig.devices import SystemClock, stopped
from rig.errors import ConfigError, RigError, StoreError, TargetError
from rig.hardware.opening import Hardware
from rig.interrupts import Interrupts
from rig.optics.rectifier import Rectifier, rectifier_of
from rig.plan import Stop
from rig.profile import Profile
from rig.sweep.conclude import SweepResult, conclude_sweep, stored_profile
from rig.sweep.measure_sample import measure_sample
from rig.sweep.measuring_thread import MeasuringThread
from rig.sweep.points import StopResult, axis_slopes_px, stop_results
from rig.sweep.request import SweepRequest, SweepSetup, plan_of, sweep_setup
from rig.sweep.take import SweepTimes, run_sweep

ShowProgress = Callable[[int, str], None]
"""Told how many samples are done, and where the sweep is."""


@dataclass(frozen=True, slots=True)
class SweepJob:
    """A sweep that can begin."""

    profile: Profile
    stops: tuple[Stop, ...]
    samples: int
    rectifier: Rectifier
    sweep_id: int | None = None
    """Of the interrupted sweep that goes on."""

    @property
    def total(self) -> int:
        """Samples of the whole sweep."""
        return len(self.stops) * self.samples


def new_sweep(
    store: Store, profile: Profile, request: SweepRequest, calibration: str | None = None
) -> SweepJob:
    """Plan a sweep from its beginning.

    Args:
        store: where calibrations are.
        profile: the rig.
        request: the wishes of the command line.
        calibration: number of the calibration to use, `none`, or None for the newest of the rig.

    Raises:
        ConfigError: the profile lacks a part, the distances make no plan, or the calibration is of
            another rig.
        StageLimitError: a distance lies outside the travel; nothing has moved.
    """
    stops, samples = plan_of(profile, request)
    rectifier = rectifier_of(profile, chosen_calibration(store, profile.name, calibration))
    return SweepJob(profile, stops, samples, rectifier)


def resumed_sweep(store: Store, profile: Profile, sweep_id: int | None) -> SweepJob:
    """Take up an interrupted sweep where it stopped, with the calibration that it began with.

    Raises:
        ConfigError: the sweep was taken with another arrangement of the rig.
        StoreError: there is no such sweep, or it is finished.
    """
    sweep = store.last_resumable_sweep(profile.name) if sweep_id is None else store.sweep(sweep_id)
    before = stored_profile(sweep)
    what = profile.first_difference(before, ("name", "views", "pitch_mm", "target"))
    if what is not None:
        raise ConfigError(
            f"asked to resume sweep {sweep.id} of rig {before.name} with profile "
            f"{profile.name}: {what} differs from what the sweep began with; use the same "
            "profile, or begin a new sweep"
        )
    rectifier = rectifier_of(profile, calibration_of(store, sweep.calibration_id))
    store.reopen_sweep(sweep.id)
    return SweepJob(profile, sweep.stops, sweep.samples_per_stop, rectifier, sweep.id)


def sweep_and_conclude(
    job: SweepJob,
    hardware: Hardware,
    store: Store,
    show_progress: ShowProgress,
    tell: Callable[[str], None],
) -> SweepResult:
    """Home, take and store every missing sample, measure, and conclude.

    Whatever ends it early leaves the stage stopped and every taken sample in the database.

    Raises:
        RigError: a device, the target, the store or the curve; the sweep can be resumed.
        KeyboardInterrupt: Ctrl-C; the sample in progress has been finished.
    """
    setup = sweep_setup(job.profile)
    with Interrupts() as interrupts:
        tell("homing the stage")
        hardware.stage.home()
        sweep_id = job.sweep_id if job.sweep_id is not None else _begin(job, hardware, store)
        try:
            if job.sweep_id is not None:
                _measure_left_over(job, store)
                _measure_old_distance_again(job, setup, hardware, store, tell)
            times = _take_all(job, sweep_id, setup, hardware, store, interrupts, show_progress)
        except BaseException as error:
            tell(
                f"sweep {sweep_id} ended early, {stopped(hardware.stage)}; every sample taken is "
                f"stored, go on with: rig sweep {job.profile.name} --resume {sweep_id}"
            )
            state = "interrupted" if isinstance(error, KeyboardInterrupt) else "failed"
            # On a full disk this fails as well; a sweep left `running` can be resumed all the same.
            with suppress(StoreError):
                store.finish_sweep(sweep_id, state)
            raise
        store.finish_sweep(sweep_id, "finished")
    return conclude_sweep(store, sweep_id, times)


def measure_again(
    store: Store, sweep_id: int, show_progress: ShowProgress, calibration: str | None = None
) -> SweepResult:
    """Compute slopes and curve of a sweep again from its stored frames; no hardware is touched.

    Args:
        store: where the sweep is.
        sweep_id: its number.
        show_progress: told how many samples are done.
        calibration: number of the calibration to use, `none`, or None for that of the sweep.

    Raises:
        ConfigError: the calibration is of another rig.
        StoreError: no such sweep, or frames are missing.
        CurveError: the slopes make no curve.
    """
    sweep = store.sweep(sweep_id)
    profile = stored_profile(sweep)
    rectifier = rectifier_of(
        profile,
        calibration_of(store, sweep.calibration_id)
        if calibration is None
        else chosen_calibration(store, profile.name, calibration),
    )
    samples = store.samples(sweep_id)
    measured: dict[SampleKey, Measurement] = {}
    for number, sample in enumerate(samples):
        measured[sample.key] = measure_sample(rectifier, store.load(sample).stack())
        show_progress(number + 1, f"{sample.stop.distance_mm:.1f} mm")
    store.replace_measurements(sweep_id, measured, calibration_id=rectifier.calibration_id)
    return conclude_sweep(store, sweep_id)


def _begin(job: SweepJob, hardware: Hardware, store: Store) -> int:
    return store.create_sweep(
        rig=job.profile.name,
        profile=job.profile.model_dump(mode="json"),
        stops=job.stops,
        samples_per_stop=job.samples,
        versions=software_versions(),
        devices={
            "camera": dict(hardware.camera.identity),
            "stage": dict(hardware.stage.identity),
        },
        calibration_id=job.rectifier.calibration_id,
    )


def _take_all(
    job: SweepJob,
    sweep_id: int,
    setup: SweepSetup,
    hardware: Hardware,
    store: Store,
    interrupts: Interrupts,
    show_progress: ShowProgress,
) -> SweepTimes:
    stored = store.samples(sweep_id)
    done: dict[int, set[int]] = {}
    for sample in stored:
        done.setdefault(sample.stop.index, set()).add(sample.number)
    times = SweepTimes(is_simulated=not isinstance(hardware.clock, SystemClock))
    count = len(stored)
    begun_s = hardware.clock.now_s()
    with MeasuringThread(job.rectifier) as measuring:
        for taken in run_sweep(
            job.stops,
            stage=hardware.stage,
            camera=hardware.camera,
            clock=hardware.clock,
            samples=job.samples,
            settle_s=setup.config.settle_s,
            move_timeout_s=setup.config.move_timeout_s,
            grab_timeout_s=job.profile.camera.timeout_s,
            times=times,
            done={stop: frozenset(numbers) for stop, numbers in done.items()},
            held=interrupts.held,
        ):
            sample = store.add_sample(
                sweep_id,
                stop=taken.stop.index,
                number=taken.sample,
                reached_mm=taken.reached_mm,
                multiview=taken.multiview,
            )
            measuring.submit(sample.key, taken.multiview.stack())
            store.save_measurements(sweep_id, measuring.finished())
            count += 1
            where = f"{taken.reached_mm:.1f} mm {taken.stop.direction}, sample {taken.sample + 1}"
            show_progress(count, where)
        for key, measurement in measuring.remaining():
            store.save_measurements(sweep_id, {key: measurement})
    times.total_s = hardware.clock.now_s() - begun_s
    return times


def _measure_left_over(job: SweepJob, store: Store) -> None:
    """Measure what was taken before an interruption: the last distance may be among it."""
    if job.sweep_id is None:
        return
    measured = store.measurements(job.sweep_id)
    for sample in store.samples(job.sweep_id):
        if sample.key not in measured:
            found = measure_sample(job.rectifier, store.load(sample).stack())
            store.save_measurements(job.sweep_id, {sample.key: found})


def _measure_old_distance_again(
    job: SweepJob,
    setup: SweepSetup,
    hardware: Hardware,
    store: Store,
    tell: Callable[[str], None],
) -> None:
    """Prove that the rig is still the one that began the sweep.

    Raises:
        TargetError: the board is not where it was at the last finished distance.
    """
    sweep_id = job.sweep_id
    if sweep_id is None:
        return
    results = stop_results(
        store.samples(sweep_id),
        store.measurements(sweep_id),
        max_motion_px=setup.config.max_motion_px,
        rectifier=job.rectifier,
    )
    finished = [r for r in results if r.point is not None and r.point.samples == job.samples]
    if not finished:
        tell(f"sweep {sweep_id}: no distance was finished before; nothing to compare with")
        return
    _compare(finished[-1], job, setup, hardware, tell)


def _compare(
    old: StopResult,
    job: SweepJob,
    setup: SweepSetup,
    hardware: Hardware,
    tell: Callable[[str], None],
) -> None:
    if old.point is None:
        raise RigError(f"stop {old.stop.index} has no slope to compare with")
    hardware.stage.move_to(old.stop.distance_mm, setup.config.move_timeout_s)
    hardware.clock.sleep_s(setup.config.settle_s)
    again = [
        measure_sample(job.rectifier, hardware.camera.grab(job.profile.camera.timeout_s).stack())
        for _ in range(job.samples)
    ]
    slopes_px = _slopes_px(again, job.rectifier)
    change_px = statistics.fmean(slopes_px) - old.point.slope_px
    text = f"{old.stop.distance_mm:.1f} mm measured again: slope differs by {change_px:+.4f} px"
    allowed_px = setup.config.max_motion_px
    if abs(change_px) > allowed_px:
        raise TargetError(
            f"{text}, allowed {allowed_px:.4f} px; camera, board or stage have changed since the "
            "sweep began: begin a new one",
            reason="changed",
        )
    tell(text)


def _slopes_px(measurements: Sequence[Measurement], rectifier: Rectifier) -> list[float]:
    for measurement in measurements:
        if measurement.failure is not None:
            raise TargetError(measurement.failure.message, reason=measurement.failure.reason)
    return axis_slopes_px(measurements, rectifier)
