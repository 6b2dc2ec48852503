"""Everything a report shows, taken from the store in one place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rig.curve import Curve
from rig.database import Store
from rig.epipolar import RectifiedViews
from rig.frames import GreyImage, Pictures
from rig.measurement import Measurement, Point
from rig.optics.optics import Optics
from rig.profile import Profile
from rig.records import Sample, SampleKey, StoredCurve, Sweep
from rig.stored import run_of_sweep
from rig.sweep.conclude import SweepResult

MOST_FAILURES_SHOWN = 3


@dataclass(frozen=True, slots=True)
class Picture:
    """One sample with its images and where the board was found in the reference view."""

    sample: Sample
    images: Pictures
    """One per view, rectified, in the order of the profile's views."""
    views: RectifiedViews
    """The same for estimators."""
    centre_px: Point
    plane: tuple[float, float, float]
    """Slope m = a + b (u - u0) + c (v - v0) about `centre_px`."""
    corners_px: NDArray[np.float64]
    """(rows, columns, 2)"""
    outline_px: NDArray[np.float64]
    """(4, 2)"""

    @property
    def square_px(self) -> float:
        """Median side of a square of the board."""
        return float(np.median(np.linalg.norm(np.diff(self.corners_px, axis=1), axis=-1)))


@dataclass(frozen=True, slots=True)
class FailedPicture:
    """A sample that gave no slope, and why."""

    sample: Sample
    image: GreyImage
    """(H, W) of the reference view."""
    message: str


@dataclass(frozen=True, slots=True)
class Evidence:
    """A sweep, its result, and the pictures that show it."""

    sweep: Sweep
    profile: Profile
    result: SweepResult
    stored_curve: StoredCurve
    samples: tuple[Sample, ...]
    measurements: Mapping[SampleKey, Measurement]
    pictures: tuple[Picture, ...]
    """Nearest, nearest to the focus distance, farthest; fewer where these are one stop."""
    failures: tuple[FailedPicture, ...]
    frames_root: str
    """Folder of the sweep's frames, relative to the root of all frames."""
    range_px: tuple[float, float]
    """Slopes that captures search."""


def gather(store: Store, result: SweepResult) -> Evidence:
    """Load what a report needs; of the images only those that it shows.

    Raises:
        StoreError: the sweep, its curve or a frame is missing or damaged.
        ConfigError: the profile was written by a version with other keys.
    """
    sweep = store.sweep(result.sweep_id)
    run = run_of_sweep(store, sweep)
    samples = store.samples(sweep.id)
    measurements = store.measurements(sweep.id)
    shown = _shown(samples, measurements, result.fit.best)
    return Evidence(
        sweep=sweep,
        profile=run.profile,
        result=result,
        stored_curve=store.curve(result.curve_id),
        samples=samples,
        measurements=measurements,
        pictures=tuple(
            _picture(run.optics, store, sample, measurements[sample.key]) for sample in shown
        ),
        failures=_failures(store, run.profile, samples, measurements),
        frames_root=sweep.folder.relative_to(store.frames).as_posix(),
        range_px=run.range_px,
    )


def _shown(
    samples: Sequence[Sample], measurements: Mapping[SampleKey, Measurement], curve: Curve
) -> list[Sample]:
    usable = [s for s in samples if s.key in measurements and _is_found(measurements[s.key])]
    if not usable:
        return []
    focus_mm = sum(curve.valid_mm) / 2 if curve.focus_mm is None else curve.focus_mm
    nearest = min(usable, key=lambda s: s.stop.distance_mm)
    focused = min(usable, key=lambda s: abs(s.stop.distance_mm - focus_mm))
    farthest = max(usable, key=lambda s: s.stop.distance_mm)
    by_distance = {s.stop.distance_mm: s for s in (nearest, focused, farthest)}
    return list(by_distance.values())


def _is_found(measurement: Measurement) -> bool:
    places = (
        measurement.plane,
        measurement.centre_px,
        measurement.corners_px,
        measurement.outline_px,
    )
    return measurement.failure is None and all(places)


def _picture(optics: Optics, store: Store, sample: Sample, measurement: Measurement) -> Picture:
    images = store.load(sample).images
    return Picture(
        sample=sample,
        images=optics.pictures(images),
        views=optics.views(images),
        centre_px=cast("Point", measurement.centre_px),
        plane=cast("tuple[float, float, float]", measurement.plane),
        corners_px=np.array(measurement.corners_px, np.float64),
        outline_px=np.array(measurement.outline_px, np.float64),
    )


def _failures(
    store: Store,
    profile: Profile,
    samples: Sequence[Sample],
    measurements: Mapping[SampleKey, Measurement],
) -> tuple[FailedPicture, ...]:
    failed: dict[int, tuple[Sample, str]] = {}
    for sample in samples:
        measurement = measurements.get(sample.key)
        if measurement is not None and measurement.failure is not None:
            failed.setdefault(sample.stop.index, (sample, measurement.failure.message))
    return tuple(
        FailedPicture(sample, store.load(sample).images[profile.reference], message)
        for sample, message in list(failed.values())[:MOST_FAILURES_SHOWN]
    )
