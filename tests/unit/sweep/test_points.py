"""One point per stop, or a reason why not."""

import dataclasses
from datetime import UTC, datetime
from pathlib import Path

import pytest

from rig.measurement import Failure, Measurement
from rig.optics.rectifier import Rectifier
from rig.plan import Stop
from rig.profile.load import load_profile
from rig.records import Sample, SampleKey
from rig.sweep.points import stop_results

RECTIFIER = Rectifier(load_profile("sim"))
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
        rectifier=RECTIFIER,
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
    (result,) = stop_results(
        [sample(0)], {(3, 0): measured(4.0)}, max_motion_px=0.1, rectifier=RECTIFIER
    )
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
    (result,) = stop_results(
        [sample(0), sample(1)], measurements, max_motion_px=0.1, rectifier=RECTIFIER
    )
    assert result.point is None
    assert result.problem is not None
    assert says in result.problem
    assert "600.0 mm (backward)" in result.problem


def test_stops_come_in_the_order_of_the_plan():
    later = dataclasses.replace(STOP, index=9)
    samples = [dataclasses.replace(sample(0), stop=later), sample(0)]
    results = stop_results(
        samples, {s.key: measured(1.0) for s in samples}, max_motion_px=0.1, rectifier=RECTIFIER
    )
    assert [r.stop.index for r in results] == [3, 9]
