"""One comparison from request to files."""

import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rig.calibration_alone import completed_run
from rig.compare.comparison import NUMBERS_FILE, PAGE_FILE, Comparison
from rig.compare.curves import CurvesAt, compare_curves
from rig.compare.distances import BoardErrors, compare_distances
from rig.compare.frames import compare_frames
from rig.compare.numbers import comparison_as_dict
from rig.database import Store, open_store
from rig.depth import write_bytes
from rig.devices import Camera
from rig.errors import ConfigError, StoreError
from rig.frames import MultiView
from rig.hardware.opening import open_camera
from rig.profile import CameraConfig, Profile
from rig.progress import Progress
from rig.records import Sweep
from rig.report.extra import report_extra
from rig.stored import (
    Run,
    RunChoice,
    new_folder,
    open_run,
    run_of_sweep,
    stored_profile,
)


@dataclass(frozen=True, slots=True)
class CompareRequest:
    """What is to be compared."""

    frames: int
    """How many multi-views."""
    sweep_id: int | None
    """Whose boards show the error against distance; None takes the sweep of the curve."""
    folder: Path | None
    """Where page and numbers go; None takes a new folder beside the database."""


def compare_on_rig(
    profile: Profile, choice: RunChoice, request: CompareRequest, progress: Progress
) -> Comparison:
    """Look up what the rig uses, open its camera, and compare.

    Args:
        profile: the rig.
        choice: which calibration and which curve; without a curve slopes are compared only.
        request: on what.
        progress: told how many distances of the sweep are done, and where.

    Raises:
        RigError: as `compare_methods`; or calibration or curve do not fit the rig.
    """
    with open_store(choice.database, absent=choice.absent) as store:
        run = open_run(store, profile, choice.calibration, choice.curve)
        with open_camera(run.profile) as (camera, _):
            run.require_unit(camera.identity)
            return compare_methods(completed_run(run, camera), request, camera, store, progress)


def compare_methods(
    run: Run, request: CompareRequest, camera: Camera, store: Store, progress: Progress
) -> Comparison:
    """Run all methods on the camera's frames and on those of a sweep; write page and numbers.

    Args:
        run: the rig; without a curve slopes are compared only.
        request: on what.
        camera: open.
        store: where the sweep is.
        progress: told how many distances of the sweep are done, and where.

    Raises:
        ConfigError: the sweep is of another rig, or the extra `report` is not installed.
        CurveError: rows miss otherwise than when the curve was made.
        DeviceError: the camera failed.
        SlopeError: no frames came, they hold no stereo pair, or they give no slopes.
        StoreError: no such sweep, frames of it are missing, or the folder cannot be written.
    """
    profile = run.profile
    folder = request.folder or new_folder(store, "comparisons", profile.name)
    _make_folder(folder)
    sweep_id = request.sweep_id
    if sweep_id is None and run.curve is not None:
        sweep_id = run.curve.sweep_id
    sweep = None if sweep_id is None else store.sweep(sweep_id)
    if sweep is not None:
        _require_same_rig(profile, sweep)
        _require_same_calibration(run, sweep)
    multiviews = itertools.islice(_in_time(camera, profile.camera), request.frames)
    comparison = Comparison(
        profile=profile,
        curve_id=None if run.curve is None else run.curve.id,
        curve_title=None if run.curve is None else run.curve.title,
        sweep_id=sweep_id,
        frames=compare_frames(run, multiviews),
        distances=() if sweep is None else _distances(run, store, sweep, progress),
        curves=() if sweep is None else _curves(run, store, sweep),
        folder=folder,
        origin=run.origin,
    )
    _write(comparison)
    return comparison


def _in_time(camera: Camera, config: CameraConfig) -> Iterator[MultiView]:
    if config.is_scan:
        while True:
            yield camera.grab(config.timeout_s)
    for multiview in camera.stream():
        if multiview.skew_s <= config.max_skew_s:
            yield multiview


def _distances(run: Run, store: Store, sweep: Sweep, progress: Progress) -> tuple[BoardErrors, ...]:
    if run.curve is None:
        return ()
    samples, measurements = store.samples(sweep.id), store.measurements(sweep.id)
    return compare_distances(
        run_of_sweep(store, sweep), run.curve, samples, measurements, store.load, progress
    )


def _curves(run: Run, store: Store, sweep: Sweep) -> tuple[CurvesAt, ...]:
    if run.curve is None or run.curve.alone is not None:
        return ()
    return compare_curves(
        run_of_sweep(store, sweep), run.curve, store.samples(sweep.id), store.measurements(sweep.id)
    )


def _require_same_rig(profile: Profile, sweep: Sweep) -> None:
    """Refuse frames of a sweep that was taken with another arrangement of cameras."""
    then = stored_profile(sweep)
    what = profile.first_difference(then, ("name", "views", "pitch_mm"))
    if what is not None:
        raise ConfigError(
            f"asked to compare {profile.name} on sweep {sweep.id} of rig {then.name}: {what} "
            "differs from what the sweep was taken with",
            advice="choose another one with --sweep",
        )


def _require_same_calibration(run: Run, sweep: Sweep) -> None:
    """Refuse slopes of a sweep that were measured otherwise than those of the curve."""
    of_curve = run.optics.calibration_id
    if run.curve is not None and sweep.calibration_id != of_curve:
        raise ConfigError(
            f"asked to compare by {run.curve.title} of calibration {of_curve or 'none'} on "
            f"sweep {sweep.id}, measured with calibration {sweep.calibration_id or 'none'}",
            advice=(
                f"run `rig fit {sweep.id} --calibration {of_curve or 'none'}`, or choose another "
                "sweep"
            ),
        )


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(
            f"comparison folder {folder}: cannot be made: {error.strerror}",
            advice="choose another one with --out",
        ) from error


def _write(comparison: Comparison) -> None:
    with report_extra("the page of a comparison", "compare again"):
        # Here, because the plot library alone takes half a second to import.
        from rig.compare.page import comparison_html  # noqa: PLC0415
    numbers = json.dumps(
        comparison_as_dict(comparison), indent=2, ensure_ascii=False, allow_nan=False
    )
    write_bytes(comparison.folder / NUMBERS_FILE, numbers.encode())
    write_bytes(comparison.folder / PAGE_FILE, comparison_html(comparison).encode())
