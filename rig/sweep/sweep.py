"""One sweep from its job to its result: home, take, store, measure, conclude."""

from contextlib import suppress

from rig.database import Store, software_versions
from rig.devices import SystemClock, stopped
from rig.errors import StoreError
from rig.hardware.opening import Hardware
from rig.interrupts import Interrupts
from rig.progress import Progress, Tell
from rig.sweep.conclude import SweepResult, conclude_sweep
from rig.sweep.job import SweepJob
from rig.sweep.measuring_thread import MeasuringThread
from rig.sweep.request import SweepSetup, sweep_setup
from rig.sweep.resume import measure_left_over, measure_old_distance_again
from rig.sweep.take import SweepTimes, run_sweep
from rig.sweep.watch import SweepWatcher, Unwatched


def sweep_and_conclude(
    job: SweepJob,
    hardware: Hardware,
    store: Store,
    progress: Progress,
    tell: Tell,
    watcher: SweepWatcher | None = None,
) -> SweepResult:
    """Home, take and store every missing sample, measure, and conclude.

    Whatever ends it early leaves the stage stopped and every taken sample in the database. A
    watcher is told what happens, after it is stored.

    Raises:
        RigError: a device, the target, the store or the curve; the sweep can be resumed.
        KeyboardInterrupt: Ctrl-C; the sample in progress has been finished.
    """
    setup = sweep_setup(job.run.profile)
    watcher = watcher or Unwatched()
    with Interrupts() as interrupts:
        tell("homing the stage")
        hardware.stage.home()
        sweep_id = job.sweep_id if job.sweep_id is not None else _begin(job, hardware, store)
        try:
            if job.sweep_id is not None:
                measure_left_over(job, sweep_id, store)
                measure_old_distance_again(job, sweep_id, hardware, store, tell)
            times = _take_all(job, sweep_id, setup, hardware, store, interrupts, progress, watcher)
        except BaseException as error:
            tell(
                f"sweep {sweep_id} ended early, {stopped(hardware.stage)}; every sample taken is "
                f"stored, go on with: rig sweep {job.run.profile.name} --resume {sweep_id}"
            )
            state = "interrupted" if isinstance(error, KeyboardInterrupt) else "failed"
            # On a full disk this fails as well; a sweep left `running` can be resumed all the same.
            with suppress(StoreError):
                store.finish_sweep(sweep_id, state)
            raise
        store.finish_sweep(sweep_id, "finished")
    result = conclude_sweep(store, sweep_id, times)
    watcher.concluded(result)
    return result


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
    )


def _take_all(
    job: SweepJob,
    sweep_id: int,
    setup: SweepSetup,
    hardware: Hardware,
    store: Store,
    interrupts: Interrupts,
    progress: Progress,
    watcher: SweepWatcher,
) -> SweepTimes:
    stored = store.samples(sweep_id)
    done: dict[int, set[int]] = {}
    for sample in stored:
        done.setdefault(sample.stop.index, set()).add(sample.number)
    times = SweepTimes(is_simulated=not isinstance(hardware.clock, SystemClock))
    count = len(stored)
    watcher.begins(job, count)
    begun_s = hardware.clock.now_s()
    with MeasuringThread(job.run) as measuring:
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
            measuring.submit(sample.key, new.multiview.stack())
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
