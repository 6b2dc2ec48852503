"""One point per stop, or a reason why not."""

import dataclasses
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from rig.curve import FieldTerm
from rig.geometry.epipolar_error import EpipolarError
from rig.measurement import Failure, Measurement
from rig.optics.nominal import nominal_optics
from rig.plan import Stop
from rig.profile.load import load_profile
from rig.records import Sample, SampleKey
from rig.sweep.points import StopResult, stop_results, without_field

OPTICS = nominal_optics(load_profile("sim"))
STOP = Stop(3, 600.0, "holdout", "backward")


def sample(number: int, reached_mm: float = 600.0) -> Sample:
    return Sample(1, STOP, number, reached_mm, datetime.now(UTC), None, Path("x"), ())


def measured(slope_px: float, shift_px: float = 0.0) -> Measurement:
    return Measurement(
        slope_px=slope_px,
        sigma_px=0.002,
        corner_slope_px=slope_px + 0.01,
        dense_slope_px=slope_px - 0.02,
        corners_px=(((10.0 + shift_px, 5.0), (20.0 + shift_px, 5.0)),),
    )


def test_samples_are_averaged_with_their_scatter():
    samples = [sample(0, 600.01), sample(1, 599.99)]
    (result,) = stop_results(
        samples,
        {samples[0].key: measured(4.0), samples[1].key: measured(4.2)},
        max_motion_px=0.1,
        optics=OPTICS,
    )
    assert result.problem is None
    assert result.point is not None
    assert result.point.distance_mm == pytest.approx(600.0)
    assert result.point.slope_px == pytest.approx(4.1)
    assert result.point.std_px == pytest.approx(0.2 / 2**0.5)
    assert result.point.sem_px == pytest.approx(0.1)
    assert (result.point.role, result.point.direction) == ("holdout", "backward")
    assert result.corner_slope_px == pytest.approx(4.11)
    assert result.dense_slope_px == pytest.approx(4.08)


def test_a_single_sample_takes_its_own_sigma():
    (result,) = stop_results([sample(0)], {(3, 0): measured(4.0)}, max_motion_px=0.1, optics=OPTICS)
    assert result.point is not None
    assert result.point.sem_px == 0.002


@pytest.mark.parametrize(
    ("second", "says"),
    [
        (None, "not measured yet"),
        (Measurement(failure=Failure("blurred", "too blurred")), "too blurred"),
        (measured(4.0, shift_px=0.2), "moved 0.200 px"),
        (dataclasses.replace(measured(4.0), corners_px=None), "its corners are not stored"),
    ],
)
def test_a_stop_that_cannot_be_trusted_gives_no_point(second: Measurement | None, says: str):
    measurements: dict[SampleKey, Measurement] = {(3, 0): measured(4.0)}
    if second is not None:
        measurements[3, 1] = second
    (result,) = stop_results([sample(0), sample(1)], measurements, max_motion_px=0.1, optics=OPTICS)
    assert result.point is None
    assert result.problem is not None
    assert says in result.problem
    assert "600.0 mm (backward)" in result.problem


def plane_measured(
    slope_px: float, centre_px: tuple[float, float], c: float, **changes: Any
) -> Measurement:
    values: dict[str, Any] = {
        "slope_px": slope_px,
        "plane": (slope_px, 1e-3, c),
        "plane_sigma": (0.1, 3e-4, 4e-4),
        "centre_px": centre_px,
        "corners_px": (((1.0, 2.0), (3.0, 4.0)), ((5.0, 6.0), (7.0, 8.0))),
    }
    return Measurement(**values | changes)


def result_of(*measurements: Measurement) -> StopResult:
    samples = [sample(number) for number in range(len(measurements))]
    by_key = {one.key: measurement for one, measurement in zip(samples, measurements, strict=True)}
    (result,) = stop_results(samples, by_key, max_motion_px=5.0, optics=OPTICS)
    return result


def test_place_and_tilt_are_means_over_the_samples():
    result = result_of(
        plane_measured(4.0, (100.0, 50.0), 2e-3), plane_measured(4.2, (104.0, 52.0), 4e-3)
    )
    assert result.centre_px == pytest.approx((102.0, 51.0))
    assert result.tilt == pytest.approx((1e-3, 3e-3))
    # Of a mean of two: a single sigma over the root of two.
    assert result.tilt_sigma == pytest.approx((3e-4 / 2**0.5, 4e-4 / 2**0.5))


def test_what_no_sample_knows_stays_unknown():
    result = result_of(Measurement(slope_px=4.0))
    assert result.centre_px is None
    assert result.tilt is None
    assert result.tilt_sigma is None
    assert result.epipolar is None
    assert result.motion_px is None
    assert result.track_residual_px is None
    assert result.corner_slope_px is None
    assert result.point is not None
    assert result.point.std_px == 0.0


def test_a_sample_without_its_plane_or_its_place_tells_no_tilt():
    whole = plane_measured(4.0, (100.0, 50.0), 2e-3)
    bare = dataclasses.replace(whole, plane=None, plane_sigma=None)
    lost = dataclasses.replace(whole, centre_px=None)
    assert result_of(whole, bare).tilt == pytest.approx((1e-3, 2e-3))
    assert result_of(whole, lost).tilt == pytest.approx((1e-3, 2e-3))
    assert result_of(whole, bare).tilt_sigma == pytest.approx((3e-4, 4e-4))


def test_motion_is_the_rms_way_of_the_corners():
    still = ((9.0, 9.0), (8.0, 8.0))
    first = plane_measured(4.0, (0.0, 0.0), 0.0, corners_px=(((0.0, 0.0), *still),))
    last = plane_measured(4.0, (0.0, 0.0), 0.0, corners_px=(((3.0, 4.0), *still),))
    assert result_of(first, last).motion_px == pytest.approx((25.0 / 3) ** 0.5)
    between = dataclasses.replace(first, corners_px=None)
    assert result_of(first, between, last).motion_px == pytest.approx((25.0 / 3) ** 0.5)
    assert result_of(first).motion_px is None


def test_motion_up_to_the_limit_is_allowed():
    still, moved = measured(4.0), measured(4.0, shift_px=1.0)
    samples = [sample(0), sample(1)]
    by_key = {samples[0].key: still, samples[1].key: moved}
    (at,) = stop_results(samples, by_key, max_motion_px=1.0, optics=OPTICS)
    assert at.problem is None
    (above,) = stop_results(samples, by_key, max_motion_px=0.999, optics=OPTICS)
    assert above.problem is not None


def test_epipolar_errors_are_means_and_the_largest():
    one, other = EpipolarError(0.1, 0.2, 0.9), EpipolarError(0.3, 0.6, 0.7)
    result = result_of(
        plane_measured(4.0, (0.0, 0.0), 0.0, epipolar=one),
        plane_measured(4.0, (0.0, 0.0), 0.0, epipolar=other),
        plane_measured(4.0, (0.0, 0.0), 0.0),
    )
    assert result.epipolar is not None
    assert result.epipolar.mean_px == pytest.approx(0.2)
    assert result.epipolar.p95_px == pytest.approx(0.4)
    assert result.epipolar.max_px == 0.9


def test_the_field_term_is_taken_out_of_every_slope():
    term = FieldTerm((320.0, 240.0), (1e-3, -2e-3), ((0.0, 0.0), (0.0, 0.0)))
    result = dataclasses.replace(
        result_of(measured(4.0)), centre_px=(330.0, 250.0), dense_slope_px=None
    )
    added_px = term.slope_px(330.0, 250.0)
    assert added_px != 0.0
    (flat,) = without_field([result], term)
    assert flat.point is not None
    assert flat.point.slope_px == pytest.approx(4.0 - added_px)
    assert flat.corner_slope_px == pytest.approx(4.01 - added_px)
    assert flat.dense_slope_px is None
    nowhere = dataclasses.replace(result, centre_px=None)
    pointless = dataclasses.replace(result, point=None)
    assert without_field([nowhere, pointless], term) == (nowhere, pointless)


def test_stops_come_in_the_order_of_the_plan():
    later = dataclasses.replace(STOP, index=9)
    samples = [dataclasses.replace(sample(0), stop=later), sample(0)]
    results = stop_results(
        samples, {s.key: measured(1.0) for s in samples}, max_motion_px=0.1, optics=OPTICS
    )
    assert [r.stop.index for r in results] == [3, 9]
