"""One sweep from its job to its result: home, take, store, measure, conclude."""

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import replace
from functools import partial

from rig.database import Store, software_versions, this_program
from rig.devices import SystemClock, stopped
from rig.errors import ConfigError, CurveError, StoreError
from rig.frames import Pictures
from rig.hardware.opening import Hardware
from rig.interrupts import Interrupted, Interrupts, saying
from rig.measurement import Measurement
from rig.progress import Progress, Tell
from rig.records import Sample, Sweep
from rig.sweep.conclude import SweepResult, conclude_sweep
from rig.sweep.job import SweepJob
from rig.sweep.measure_sample import measure_sample
from rig.sweep.measuring_thread import MeasuringThread
from rig.sweep.request import sweep_setup
from rig.sweep.resume import measure_left_over, measure_old_distance_again, scans_anew
from rig.sweep.take import SweepTimes, run_sweep
from rig.sweep.watch import SweepWatcher, Unwatched
from rig.unit import unit_of


def sweep_and_conclude(
    job: SweepJob,
    hardware: Hardware,
    store: Store,
    progress: Progress,
    tell: Tell,
    watcher: SweepWatcher | None = None,
) -> SweepResult:
    """Home, take and store every missing sample, measure, and conclude.

    From its first row to its curve the sweep belongs to this program. Whatever ends it early leaves
    the stage stopped and every taken sample in the database. A watcher is told what happens,
    after it is stored.

    Raises:
        OwnedError: another program works on this sweep, or has taken it over.
        RigError: a device, the target, the store or the curve; the sweep can be resumed.
        Interrupted: Ctrl-C; the sample in progress has been finished.
    """
    watcher = watcher or Unwatched()
    with ExitStack() as owning:
        if job.sweep_id is not None:
            owning.enter_context(_ownership(job, store))
        with Interrupts() as interrupts, MeasuringThread(_measure(job)) as measuring:
            try:
                job.run.require_unit(hardware.camera.identity)
                is_new = job.sweep_id is None
                watcher.begins(job, 0 if is_new else len(store.samples(_number(job))))
                tell("homing the stage")
                hardware.stage.home()
                if job.sweep_id is None:
                    job = replace(job, sweep_id=_begin(job, hardware, store))
                    owning.enter_context(_ownership(job, store))
                else:
                    _go_on(job, hardware, store, tell)
                times = _take_all(job, hardware, store, interrupts, measuring, progress, watcher)
            except BaseException as error:
                # The stage first: whatever else is to be done may take its time.
                with interrupts.shielded():
                    stands = stopped(hardware.stage)
                is_interrupt = interrupts.came or isinstance(error, KeyboardInterrupt)
                _end_early(job, error, stands, store, tell, is_interrupt=is_interrupt)
                raise
        result = conclude_taken(job, store, tell, times)
        watcher.concluded(result)
        return result


def conclude_taken(
    job: SweepJob, store: Store, tell: Tell, times: SweepTimes | None = None
) -> SweepResult:
    """Conclude a sweep that has all its samples; no device is needed.

    Args:
        job: a resumed sweep of which no sample is missing.
        store: where it is.
        tell: hears of it.
        times: where the time of the sweep went, of one that was just taken.

    Raises:
        OwnedError: another program works on it.
        CurveError: the slopes make no curve; the sweep has failed, its samples are kept.
        Interrupted: every sample is stored; it can be concluded later.
    """
    number = _number(job)
    with (
        _ownership(job, store),
        saying(lambda: f"every sample of sweep {number} is stored; conclude it: {job.go_on}"),
    ):
        if times is None:
            tell(f"sweep {number} has all its samples; no device is needed to conclude it")
            store.reopen_sweep(number)
            measure_left_over(job, number, store)
        try:
            return conclude_sweep(store, number, times)
        except CurveError:
            store.stop_sweep(number, failed=True)
            raise


def _ownership(job: SweepJob, store: Store) -> AbstractContextManager[None]:
    number = _number(job)
    return store.owned_sweep(number, f"asked to work on sweep {number}")


def _number(job: SweepJob) -> int:
    if job.sweep_id is None:
        raise AssertionError  # it has a row before anything asks
    return job.sweep_id


def _go_on(job: SweepJob, hardware: Hardware, store: Store, tell: Tell) -> None:
    """Take up an interrupted sweep: only now, with its devices open, is anything in it changed."""
    number = _number(job)
    _require_same_unit(store.sweep(number), unit_of(job.run.profile, hardware.camera.identity))
    store.reopen_sweep(number)
    measure_left_over(job, number, store)
    measure_old_distance_again(job, number, hardware, store, tell)
    if job.run.profile.camera.is_scan:
        tell(scans_anew(len(store.samples(number)), len(job.stops) * job.samples))


def _require_same_unit(sweep: Sweep, here: str) -> None:
    """Let no half of a sweep come from another rig.

    Raises:
        ConfigError: it began with another one of the same name.
    """
    if here and sweep.unit and sweep.unit != here:
        raise ConfigError(
            f"asked to resume sweep {sweep.id} of unit {sweep.unit} of rig {sweep.rig}, this one "
            f"is {here}",
            advice="go on where it began, or begin a new sweep",
        )


def _end_early(
    job: SweepJob,
    error: BaseException,
    stands: str,
    store: Store,
    tell: Tell,
    *,
    is_interrupt: bool,
) -> None:
    """Write down that a sweep ended early, and say how to go on.

    Raises:
        Interrupted: instead of a bare KeyboardInterrupt; it says what was saved.
    """
    if job.sweep_id is None:
        saved = f"nothing was taken yet, {stands}"
    else:
        saved = f"sweep {job.sweep_id} ended early, {stands}; every sample taken is stored, go on "
        saved += f"with: {job.go_on}"
        # On a full disk this fails as well; a sweep left as it was can be resumed all the same.
        with suppress(StoreError):
            store.stop_sweep(job.sweep_id, failed=not is_interrupt)
    if is_interrupt:
        raise Interrupted(saved) from error
    tell(saved)


def _begin(job: SweepJob, hardware: Hardware, store: Store) -> int:
    return store.create_sweep(
        rig=job.run.profile.name,
        profile=job.run.profile.model_dump(mode="json"),
        stops=job.stops,
        samples_per_stop=job.samples,
        versions=software_versions(),
        devices={
            "camera": dict(hardware.camera.identity),
            "stage": dict(hardware.stage.identity),
        },
        calibration_id=job.run.optics.calibration_id,
        note=job.note,
        unit=unit_of(job.run.profile, hardware.camera.identity),
        provenance=this_program(job.tags),
    )


def _measure(job: SweepJob) -> Callable[[Pictures], Measurement]:
    return partial(measure_sample, job.run.profile, job.run.optics)


def _read_back(store: Store, sample: Sample) -> Callable[[], Pictures]:
    return lambda: store.load(sample).images


def _take_all(
    job: SweepJob,
    hardware: Hardware,
    store: Store,
    interrupts: Interrupts,
    measuring: MeasuringThread,
    progress: Progress,
    watcher: SweepWatcher,
) -> SweepTimes:
    sweep_id, setup = _number(job), sweep_setup(job.run.profile)
    stored = store.samples(sweep_id)
    done: dict[int, set[int]] = {}
    for sample in stored:
        done.setdefault(sample.stop.index, set()).add(sample.number)
    times = SweepTimes(is_simulated=not isinstance(hardware.clock, SystemClock))
    count = len(stored)
    begun_s = hardware.clock.now_s()
    for new in run_sweep(
        job.stops,
        stage=hardware.stage,
        camera=hardware.camera,
        clock=hardware.clock,
        samples=job.samples,
        settle_s=setup.config.settle_s,
        move_timeout_s=setup.config.move_timeout_s,
        grab_timeout_s=job.run.profile.camera.timeout_s,
        times=times,
        done={stop: frozenset(numbers) for stop, numbers in done.items()},
        deferred=interrupts.deferred,
    ):
        sample = store.add_sample(
            sweep_id,
            stop=new.stop.index,
            number=new.sample,
            reached_mm=new.reached_mm,
            multiview=new.multiview,
        )
        watcher.took(new, sample.key)
        measuring.submit(sample.key, new.multiview.images, _read_back(store, sample))
        finished = measuring.finished()
        store.save_measurements(sweep_id, finished)
        watcher.measured(finished)
        count += 1
        where = f"{new.reached_mm:.1f} mm {new.stop.direction}, sample {new.sample + 1}"
        progress(count, where)
    for key, measurement in measuring.remaining():
        store.save_measurements(sweep_id, {key: measurement})
        watcher.measured({key: measurement})
    times.total_s = hardware.clock.now_s() - begun_s
    return times
