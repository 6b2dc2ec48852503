"""One comparison from request to files."""

import itertools
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rig.compare.comparison import NUMBERS_FILE, PAGE_FILE, Comparison
from rig.compare.distances import BoardErrors, compare_distances
from rig.compare.frames import compare_frames
from rig.curve import Curve
from rig.database import Store
from rig.depth import write_bytes
from rig.devices import Camera
from rig.errors import ConfigError, StoreError
from rig.frames import MultiView
from rig.optics.rectifier import Rectifier
from rig.profile import Profile
from rig.report.extra import report_extra
from rig.sweep.conclude import stored_profile, stored_rectifier


@dataclass(frozen=True, slots=True)
class CompareRequest:
    """What is to be compared."""

    frames: int
    """How many multi-views."""
    curve: tuple[int, Curve] | None
    """The curve and its number; None compares slopes only."""
    sweep_id: int | None
    """Whose boards show the error against distance; None takes the sweep of the curve."""
    folder: Path
    """Where page and numbers go."""


def compare_methods(
    rectifier: Rectifier,
    request: CompareRequest,
    camera: Camera,
    store: Store,
    show_progress: Callable[[int, str], None],
) -> Comparison:
    """Run all methods on the camera's frames and on those of a sweep; write page and numbers.

    Args:
        rectifier: of the rig.
        request: on what.
        camera: open.
        store: where the sweep is.
        show_progress: told how many distances of the sweep are done, and where.

    Raises:
        ConfigError: the sweep is of another rig, or the extra `report` is not installed.
        DeviceError: the camera failed.
        SlopeError: no frames came, they hold no stereo pair, or they give no slopes.
        StoreError: no such sweep, frames of it are missing, or the folder cannot be written.
    """
    profile = rectifier.profile
    _make_folder(request.folder)
    curve_id, curve = (None, None) if request.curve is None else request.curve
    sweep_id = request.sweep_id
    if sweep_id is None and curve_id is not None:
        sweep_id = store.curve(curve_id).sweep_id
    if sweep_id is not None:
        _require_same_rig(profile, store, sweep_id)
    if sweep_id is not None and curve_id is not None:
        _require_same_calibration(store, sweep_id, curve_id)
    multiviews = itertools.islice(_in_time(camera, profile.camera.max_skew_s), request.frames)
    comparison = Comparison(
        profile=profile,
        curve_id=curve_id,
        sweep_id=sweep_id,
        frames=compare_frames(rectifier, multiviews, curve),
        distances=_distances(curve, store, sweep_id, show_progress),
        folder=request.folder,
    )
    _write(comparison)
    return comparison


def _in_time(camera: Camera, max_skew_s: float) -> Iterator[MultiView]:
    return (multiview for multiview in camera.stream() if multiview.skew_s <= max_skew_s)


def _distances(
    curve: Curve | None,
    store: Store,
    sweep_id: int | None,
    show_progress: Callable[[int, str], None],
) -> tuple[BoardErrors, ...]:
    if curve is None or sweep_id is None:
        return ()
    samples, measurements = store.samples(sweep_id), store.measurements(sweep_id)
    rectifier = stored_rectifier(store, store.sweep(sweep_id))
    return compare_distances(rectifier, curve, samples, measurements, store.load, show_progress)


def _require_same_rig(profile: Profile, store: Store, sweep_id: int) -> None:
    """Refuse frames of a sweep that was taken with another arrangement of cameras."""
    taken = stored_profile(store.sweep(sweep_id))
    what = profile.first_difference(taken, ("name", "views", "pitch_mm"))
    if what is not None:
        raise ConfigError(
            f"asked to compare {profile.name} on sweep {sweep_id} of rig {taken.name}: {what} "
            "differs from what the sweep was taken with",
            advice="choose another one with --sweep",
        )


def _require_same_calibration(store: Store, sweep_id: int, curve_id: int) -> None:
    """Refuse slopes of a sweep that were measured otherwise than those of the curve."""
    of_sweep, of_curve = (
        store.sweep(sweep_id).calibration_id,
        store.curve(curve_id).calibration_id,
    )
    if of_sweep != of_curve:
        raise ConfigError(
            f"asked to compare by curve {curve_id} of calibration {of_curve or 'none'} on sweep "
            f"{sweep_id}, measured with calibration {of_sweep or 'none'}",
            advice=f"run `rig fit {sweep_id} "
            f"--calibration {of_curve or 'none'}`, or choose another sweep",
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
    numbers = json.dumps(comparison.as_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    write_bytes(comparison.folder / NUMBERS_FILE, numbers.encode())
    write_bytes(comparison.folder / PAGE_FILE, comparison_html(comparison).encode())
