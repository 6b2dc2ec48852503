"""What a sweep is asked to do, and how long that takes, by hand."""

import math

import pytest

from rig.errors import ConfigError
from rig.plan import Stop
from rig.profile import Profile
from rig.profile.load import load_profile
from rig.sweep.request import SweepRequest, plan_of, planned_times

PROFILE = load_profile(
    "sim",
    [
        "sweep.from_mm=500", "sweep.to_mm=900", "sweep.count=5", "sweep.samples=4",
        "sweep.holdout_every=0", "sweep.backward_every=0", "sweep.settle_s=0.25",
    ],
)  # fmt: skip


def distances_mm(request: SweepRequest) -> list[float]:
    return [stop.distance_mm for stop in plan_of(PROFILE, request)[0]]


def test_what_is_not_asked_for_comes_from_the_profile():
    assert distances_mm(SweepRequest()) == [500.0, 600.0, 700.0, 800.0, 900.0]
    assert plan_of(PROFILE, SweepRequest())[1] == 4


def test_what_is_asked_for_goes_before_the_profile():
    assert distances_mm(SweepRequest(from_mm=700.0, count=3)) == [700.0, 800.0, 900.0]
    assert distances_mm(SweepRequest(to_mm=600.0, count=2)) == [500.0, 600.0]
    assert distances_mm(SweepRequest(at_mm=(620.0, 610.0), count=7)) == [610.0, 620.0]
    assert plan_of(PROFILE, SweepRequest(samples=1))[1] == 1


@pytest.mark.parametrize("part", ["stage", "target", "sweep"])
def test_a_part_that_is_missing_is_named(part: str):
    without = PROFILE.model_copy(update={part: None})
    with pytest.raises(ConfigError, match=rf"a sweep needs \[{part}\]"):
        plan_of(without, SweepRequest())


def slow_stage() -> Profile:
    """10 mm/s, reached within 5 mm at 10 mm/s2; the last 4 mm of every move go outwards."""
    assert PROFILE.stage is not None
    changes = {"speed_mm_s": 10.0, "acceleration_mm_s2": 10.0, "approach_mm": 4.0}
    return PROFILE.model_copy(update={"stage": PROFILE.stage.model_copy(update=changes)})


def moves_s(*places_mm: float) -> float:
    stops = tuple(Stop(n, place, "fit", "forward") for n, place in enumerate(places_mm))
    return planned_times(slow_stage(), stops, 2).moves_s


def test_moves_take_their_time():
    """A long way s takes s / 10 + 1 s, a short one 2 sqrt(s / 10)."""
    assert moves_s(500.0) == 0.0
    assert moves_s(500.0, 600.0) == pytest.approx(11.0)
    assert moves_s(500.0, 600.0, 650.0) == pytest.approx(11.0 + 6.0)
    # Back by 20 mm: 24 mm towards the camera, then 4 mm away from it.
    assert moves_s(600.0, 580.0) == pytest.approx(24.0 / 10.0 + 1.0 + 2.0 * math.sqrt(0.4))
    assert moves_s(600.0, 604.0) == pytest.approx(2.0 * math.sqrt(0.4))
    assert moves_s(600.0, 603.0) == pytest.approx(2.0 * math.sqrt(0.1) + 2.0 * math.sqrt(0.4))


def test_every_stop_settles_and_every_sample_is_exposed():
    stops = tuple(Stop(n, 500.0 + n, "fit", "forward") for n in range(3))
    times = planned_times(slow_stage(), stops, 2)
    assert times.settling_s == 0.75
    assert times.exposures_s == pytest.approx(PROFILE.camera.typical_grab_s * 6)
