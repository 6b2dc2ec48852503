"""What comes first when an interrupted sweep goes on: proof that the rig is still the same."""

import statistics
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rig.curve import CurvePoint
from rig.errors import TargetError
from rig.factory import changed_calibration
from rig.hardware.opening import Hardware
from rig.measurement import Measurement
from rig.optics.optics import Optics
from rig.plan import Stop
from rig.profile import Profile
from rig.progress import Tell
from rig.stored import camera_identity
from rig.sweep.job import SweepJob
from rig.sweep.measure_sample import measure_sample
from rig.sweep.points import axis_slopes_px, stop_results, with_reading
from rig.sweep.request import sweep_setup

if TYPE_CHECKING:
    from rig.database import Store


VISITS = 3.0 * 2.0**0.5
"""By how many sigmas of one reading two readings of one distance may differ."""


def measure_left_over(job: SweepJob, sweep_id: int, store: "Store") -> None:
    """Measure what was taken before an interruption: the last distance may be among it."""
    measured = store.measurements(sweep_id)
    for sample in store.samples(sweep_id):
        if sample.key not in measured:
            images = store.load(sample).images
            measurement = measure_sample(job.run.profile, job.run.optics, images)
            store.save_measurements(sweep_id, {sample.key: measurement})


def measure_old_distance_again(
    job: SweepJob, sweep_id: int, hardware: Hardware, store: "Store", tell: Tell
) -> None:
    """Prove that the rig is still the one that began the sweep.

    Raises:
        TargetError: the board is not where it was at the last finished distance, or the device's
            own calibration is another one.
    """
    changed = changed_calibration(camera_identity(store.sweep(sweep_id)), hardware.camera.identity)
    if changed is not None:
        raise TargetError(
            f"sweep {sweep_id} was begun while the device held another calibration of its own "
            f"({changed} differs)",
            advice="its cameras were calibrated anew since: begin a new sweep",
            reason="changed",
        )
    stage = job.run.profile.stage
    results = with_reading(
        stop_results(
            store.samples(sweep_id),
            store.measurements(sweep_id),
            max_motion_px=sweep_setup(job.run.profile).config.max_motion_px,
            optics=job.run.optics,
        ),
        0.0 if stage is None else stage.distance_sigma_mm,
    )
    finished = [
        (result.stop, result.point)
        for result in results
        if result.point is not None and result.point.samples == job.samples
    ]
    if not finished:
        tell(f"sweep {sweep_id}: no distance was finished before; nothing to compare with")
        return
    _measure_again(*finished[-1], job, hardware, tell)


def scans_anew(stored: int, wanted: int) -> str:
    """Say what becomes of a scan that was cut off.

    Its takes cannot be joined to new ones: the stage of the board was homed since, so the board
    comes back within the play of its stage only, and a scan is of one scene at rest.

    Args:
        stored: scans of the sweep that are whole.
        wanted: scans that it is to have.
    """
    return (
        f"{stored} of {wanted} scans are whole and kept; one that was cut off between two views is "
        "taken anew from its first view: the board may have moved since"
    )


def allowed_change_px(profile: Profile, before: CurvePoint, max_motion_px: float) -> float:
    """Return by how much the slope of a distance may differ when it is visited again.

    Args:
        profile: of the sweep.
        before: the distance as it was measured, its `sem_px` with the uncertainty of the distance.
        max_motion_px: largest motion of a board that comes back by itself.
    """
    if profile.stage is None or not profile.stage.distance_sigma_mm:
        return max_motion_px
    return max_motion_px + VISITS * before.sem_px  # a hand does not find the same place again


def _measure_again(
    stop: Stop, before: CurvePoint, job: SweepJob, hardware: Hardware, tell: Tell
) -> None:
    profile, optics = job.run.profile, job.run.optics
    config = sweep_setup(profile).config
    hardware.stage.move_to(stop.distance_mm, config.move_timeout_s)
    hardware.clock.sleep_s(config.settle_s)
    now = [
        measure_sample(profile, optics, hardware.camera.grab(profile.camera.timeout_s).images)
        for _ in range(job.samples)
    ]
    change_px = statistics.fmean(_slopes_px(now, optics)) - before.slope_px
    text = f"{stop.distance_mm:.1f} mm measured again: slope differs by {change_px:+.4f} px"
    allowed_px = allowed_change_px(profile, before, config.max_motion_px)
    if abs(change_px) > allowed_px:
        raise TargetError(
            f"{text}, allowed {allowed_px:.4f} px",
            advice="camera, board or stage have changed since the sweep began: begin a new one",
            reason="changed",
        )
    tell(text)


def _slopes_px(measurements: Sequence[Measurement], optics: Optics) -> list[float]:
    for measurement in measurements:
        if measurement.failure is not None:
            raise TargetError(measurement.failure.message, reason=measurement.failure.reason)
    return axis_slopes_px(measurements, optics)
