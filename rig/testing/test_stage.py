"""What every stage promises, whatever is behind it; `stage_case` is the package's fixture."""

import math
import threading
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rig.devices import Stage
from rig.errors import DeviceLostError, StageAlarmError, StageLimitError, StageTimeoutError
from rig.plan import plan_stops
from rig.sweep.take import SweepTimes, run_sweep
from rig.testing.cases import StageCase
from rig.testing.witness import Witness

TIMEOUT_S = 60.0


@pytest.fixture
def stage(stage_case: StageCase) -> Iterator[Stage]:
    """An open and homed stage."""
    with stage_case.stage as opened:
        opened.home()
        yield opened


def middle_mm(stage: Stage) -> float:
    return 0.5 * sum(stage.travel_mm)


def test_it_is_refused_while_closed(stage_case: StageCase) -> None:
    stage = stage_case.stage
    stage.stop()
    with pytest.raises((StageAlarmError, DeviceLostError)):
        _ = stage.position_mm
    with pytest.raises((StageAlarmError, DeviceLostError)):
        stage.move_to(middle_mm(stage), TIMEOUT_S)


def test_it_says_who_it_is(stage: Stage) -> None:
    assert stage.identity["kind"]
    assert all(isinstance(value, str) for value in stage.identity.values())


def test_no_position_before_homing(stage_case: StageCase) -> None:
    with stage_case.stage as stage:
        with pytest.raises(StageAlarmError, match="home") as asked:
            _ = stage.position_mm
        with pytest.raises(StageAlarmError, match="home") as sent:
            stage.move_to(middle_mm(stage), TIMEOUT_S)
    assert asked.value.code == sent.value.code == "not homed"


def test_it_reaches_both_ends_and_the_middle(stage: Stage, stage_case: StageCase) -> None:
    near_mm, far_mm = stage.travel_mm
    for wanted_mm in (far_mm, near_mm, middle_mm(stage), near_mm, far_mm):
        reached_mm = stage.move_to(wanted_mm, TIMEOUT_S)
        assert reached_mm == pytest.approx(wanted_mm, abs=stage_case.tolerance_mm)
        assert stage.position_mm == pytest.approx(wanted_mm, abs=stage_case.tolerance_mm)


@settings(
    max_examples=5,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(share=st.floats(0.0, 1.0))
def test_it_reaches_any_place_inside(stage: Stage, stage_case: StageCase, share: float) -> None:
    near_mm, far_mm = stage.travel_mm
    wanted_mm = min(far_mm, near_mm + share * (far_mm - near_mm))
    reached_mm = stage.move_to(wanted_mm, TIMEOUT_S)
    assert reached_mm == pytest.approx(wanted_mm, abs=stage_case.tolerance_mm)


def test_going_nowhere_is_fine(stage: Stage, stage_case: StageCase) -> None:
    for _ in range(2):
        reached_mm = stage.move_to(middle_mm(stage), TIMEOUT_S)
        assert reached_mm == pytest.approx(middle_mm(stage), abs=stage_case.tolerance_mm)


@pytest.mark.parametrize("excess_mm", [-1e-3, -1e9, 1e-3, 1e9, math.inf, -math.inf, math.nan])
def test_outside_the_travel_nothing_moves(stage: Stage, excess_mm: float) -> None:
    near_mm, far_mm = stage.travel_mm
    before_mm = stage.position_mm
    with pytest.raises(StageLimitError, match=r"travel is"):
        stage.move_to((far_mm if excess_mm > 0.0 else near_mm) + excess_mm, TIMEOUT_S)
    assert stage.position_mm == before_mm


def test_too_little_time_stops_the_stage(stage: Stage, stage_case: StageCase) -> None:
    near_mm, far_mm = stage.travel_mm
    stage.move_to(near_mm, TIMEOUT_S)
    with pytest.raises(StageTimeoutError):
        stage.move_to(far_mm, 0.5)
    if stage_case.brakes:
        stopped_mm = stage.position_mm
        assert near_mm < stopped_mm < far_mm
        stage_case.clock.sleep_s(1.0)
        assert stage.position_mm == stopped_mm
    else:
        with pytest.raises(StageAlarmError, match="home"):
            _ = stage.position_mm
        stage.home()
    assert stage.move_to(far_mm, TIMEOUT_S) == pytest.approx(far_mm, abs=stage_case.tolerance_mm)


def test_stop_is_safe_at_any_time_and_keeps_the_position_at_rest(stage: Stage) -> None:
    before_mm = stage.position_mm
    for _ in range(3):
        stage.stop()
    assert stage.position_mm == before_mm
    stage.move_to(middle_mm(stage), TIMEOUT_S)


def test_stop_from_another_thread_ends_the_move(stage: Stage, stage_case: StageCase) -> None:
    near_mm, far_mm = stage.travel_mm
    stage.move_to(near_mm, TIMEOUT_S)
    failures: list[Exception] = []

    def move() -> None:
        try:
            stage.move_to(far_mm, TIMEOUT_S)
        except StageAlarmError as error:
            failures.append(error)

    # The stop may come before, in or after the move; in each case the stage ends at rest.
    mover = threading.Thread(target=move)
    mover.start()
    stage.stop()
    mover.join()
    stage.stop()
    try:
        stopped_mm = stage.position_mm
    except StageAlarmError as error:
        assert error.code == "not homed"
        assert not stage_case.brakes
        assert failures
        stage.home()
        stopped_mm = stage.position_mm
    stage_case.clock.sleep_s(1.0)
    assert stage.position_mm == stopped_mm
    assert all(isinstance(f, StageAlarmError) and f.code == "stopped" for f in failures)
    assert failures or stopped_mm == pytest.approx(far_mm, abs=stage_case.tolerance_mm)


def test_a_sweep_runs_over_it(stage: Stage, stage_case: StageCase) -> None:
    near_mm, far_mm = stage.travel_mm
    distances_mm = [near_mm + share * (far_mm - near_mm) for share in (0.0, 0.3, 0.6, 1.0)]
    stops = plan_stops(
        distances_mm, holdout_every=0, backward_every=2, travel_mm=stage.travel_mm, stage="stage"
    )
    taken = run_sweep(
        stops,
        stage=stage,
        camera=Witness(stage_case.clock, lambda: math.nan),
        clock=stage_case.clock,
        samples=2,
        settle_s=0.1,
        move_timeout_s=TIMEOUT_S,
        grab_timeout_s=1.0,
        times=SweepTimes(),
    )
    for sample in taken:
        wanted_mm = sample.stop.distance_mm
        assert sample.reached_mm == pytest.approx(wanted_mm, abs=stage_case.tolerance_mm)


def test_after_opening_again_only_a_kept_reference_counts(stage_case: StageCase) -> None:
    with stage_case.stage as stage:
        stage.home()
        stage.move_to(middle_mm(stage), TIMEOUT_S)
        before_mm = stage.position_mm
    with stage_case.stage as stage:
        if stage_case.is_reset_by_opening:
            with pytest.raises(StageAlarmError, match="home"):
                _ = stage.position_mm
            stage.home()
        else:
            assert stage.position_mm == before_mm
        stage.move_to(middle_mm(stage), TIMEOUT_S)
