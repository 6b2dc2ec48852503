"""What every stage promises, whatever is behind it.

The real stage takes part where RIG_GRBL_PORT names its port; RIG_GRBL_TRAVEL_MM ("near,far") and
RIG_GRBL_ZERO_MM describe it. It homes and moves: clear its way.
"""

import math
import os
import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass

import pytest
from rig_drivers.grbl.controller import grbl_stage

from rig.devices import Clock, Stage, SystemClock
from rig.errors import (
    DeviceLostError,
    StageAlarmError,
    StageLimitError,
    StageTimeoutError,
)
from rig.plan import plan_stops
from rig.profile import GrblStageConfig, MarlinFirmwareConfig, ZaberFirmwareConfig
from rig.sweep.take import SweepTimes, run_sweep
from tests.support.stages import FIRMWARE, MARLIN, STAGE, ZABER, ZERO_MM, simulated_bench
from tests.support.witness import Witness

TIMEOUT_S = 60.0


@dataclass(frozen=True, slots=True)
class Candidate:
    """A stage, not yet open, and the clock it lives on."""

    stage: Stage
    clock: Clock
    tolerance_mm: float
    brakes: bool = True
    """Whether stopping in motion keeps the position."""
    is_reset_by_opening: bool = True


@contextmanager
def grbl_over_simulated_wire() -> Generator[Candidate]:
    with simulated_bench() as bench:
        yield Candidate(bench.stage, bench.clock, STAGE.tolerance_mm)


@contextmanager
def grblhal_over_simulated_wire() -> Generator[Candidate]:
    with simulated_bench(firmware=FIRMWARE.model_copy(update={"grbl_dialect": "grblhal"})) as bench:
        yield Candidate(bench.stage, bench.clock, STAGE.tolerance_mm)


@contextmanager
def fluidnc_over_simulated_wire() -> Generator[Candidate]:
    config = STAGE.model_copy(update={"distance_at_machine_zero_mm": ZERO_MM - 2.0})
    firmware = FIRMWARE.model_copy(update={"grbl_dialect": "fluidnc"})
    with simulated_bench(config, firmware) as bench:
        yield Candidate(bench.stage, bench.clock, STAGE.tolerance_mm)


@contextmanager
def zaber_over_simulated_wire() -> Generator[Candidate]:
    with simulated_bench(ZABER) as bench:
        yield Candidate(bench.stage, bench.clock, ZABER.tolerance_mm, is_reset_by_opening=False)


@contextmanager
def zaber_in_a_chain() -> Generator[Candidate]:
    chain = ZaberFirmwareConfig(addresses=(2, 1, 7), address=7, axes=3, axis=2)
    config = ZABER.model_copy(update={"device_address": 7, "axis_number": 2})
    with simulated_bench(config, FIRMWARE.model_copy(update={"zaber": chain})) as bench:
        yield Candidate(bench.stage, bench.clock, ZABER.tolerance_mm, is_reset_by_opening=False)


@contextmanager
def marlin_over_simulated_wire() -> Generator[Candidate]:
    with simulated_bench(MARLIN) as bench:
        yield Candidate(bench.stage, bench.clock, MARLIN.tolerance_mm, brakes=False)


@contextmanager
def marlin_without_emergency_parser() -> Generator[Candidate]:
    plain = MarlinFirmwareConfig(emergency_parser=False, advanced_ok=True)
    with simulated_bench(MARLIN, FIRMWARE.model_copy(update={"marlin": plain})) as bench:
        yield Candidate(bench.stage, bench.clock, MARLIN.tolerance_mm, brakes=False)


@contextmanager
def real_grbl() -> Generator[Candidate]:
    port = os.environ.get("RIG_GRBL_PORT")
    if port is None:
        pytest.skip("RIG_GRBL_PORT names no real stage")
    near, far = os.environ["RIG_GRBL_TRAVEL_MM"].split(",")
    config = GrblStageConfig(
        kind="grbl",
        port=port,
        travel_mm=(float(near), float(far)),
        distance_at_machine_zero_mm=float(os.environ["RIG_GRBL_ZERO_MM"]),
        speed_mm_s=10.0,
    )
    clock = SystemClock()
    yield Candidate(grbl_stage(config, clock), clock, config.tolerance_mm)


Maker = Callable[[], AbstractContextManager[Candidate]]


@pytest.fixture(
    params=[
        grbl_over_simulated_wire,
        grblhal_over_simulated_wire,
        fluidnc_over_simulated_wire,
        zaber_over_simulated_wire,
        zaber_in_a_chain,
        marlin_over_simulated_wire,
        marlin_without_emergency_parser,
        real_grbl,
    ]
)
def candidate(request: pytest.FixtureRequest) -> Iterator[Candidate]:
    make: Maker = request.param
    with make() as made:
        yield made


@pytest.fixture
def stage(candidate: Candidate) -> Iterator[Stage]:
    """An open and homed stage."""
    with candidate.stage as opened:
        opened.home()
        yield opened


def middle_mm(stage: Stage) -> float:
    return 0.5 * sum(stage.travel_mm)


def test_it_is_refused_while_closed(candidate: Candidate) -> None:
    stage = candidate.stage
    stage.stop()
    with pytest.raises((StageAlarmError, DeviceLostError)):
        _ = stage.position_mm
    with pytest.raises((StageAlarmError, DeviceLostError)):
        stage.move_to(middle_mm(stage), TIMEOUT_S)


def test_it_says_who_it_is(stage: Stage) -> None:
    assert stage.identity["kind"]
    assert all(isinstance(value, str) for value in stage.identity.values())


def test_no_position_before_homing(candidate: Candidate) -> None:
    with candidate.stage as stage:
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm
        with pytest.raises(StageAlarmError, match="home the stage first"):
            stage.move_to(middle_mm(stage), TIMEOUT_S)


def test_it_reaches_both_ends_and_the_middle(stage: Stage, candidate: Candidate) -> None:
    near_mm, far_mm = stage.travel_mm
    for wanted_mm in (far_mm, near_mm, middle_mm(stage), near_mm, far_mm):
        reached_mm = stage.move_to(wanted_mm, TIMEOUT_S)
        assert reached_mm == pytest.approx(wanted_mm, abs=candidate.tolerance_mm)
        assert stage.position_mm == pytest.approx(wanted_mm, abs=candidate.tolerance_mm)


def test_going_nowhere_is_fine(stage: Stage, candidate: Candidate) -> None:
    for _ in range(2):
        reached_mm = stage.move_to(middle_mm(stage), TIMEOUT_S)
        assert reached_mm == pytest.approx(middle_mm(stage), abs=candidate.tolerance_mm)


@pytest.mark.parametrize("excess_mm", [-1e-3, -1e9, 1e-3, 1e9, math.inf, -math.inf, math.nan])
def test_outside_the_travel_nothing_moves(stage: Stage, excess_mm: float) -> None:
    near_mm, far_mm = stage.travel_mm
    before_mm = stage.position_mm
    with pytest.raises(StageLimitError, match=r"travel is"):
        stage.move_to((far_mm if excess_mm > 0.0 else near_mm) + excess_mm, TIMEOUT_S)
    assert stage.position_mm == before_mm


def test_too_little_time_stops_the_stage(stage: Stage, candidate: Candidate) -> None:
    near_mm, far_mm = stage.travel_mm
    stage.move_to(near_mm, TIMEOUT_S)
    with pytest.raises(StageTimeoutError, match="not at rest"):
        stage.move_to(far_mm, 0.5)
    if candidate.brakes:
        stopped_mm = stage.position_mm
        assert near_mm < stopped_mm < far_mm
        candidate.clock.sleep_s(1.0)
        assert stage.position_mm == stopped_mm
    else:
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm
        stage.home()
    assert stage.move_to(far_mm, TIMEOUT_S) == pytest.approx(far_mm, abs=candidate.tolerance_mm)


def test_stop_is_safe_at_any_time_and_keeps_the_position_at_rest(stage: Stage) -> None:
    before_mm = stage.position_mm
    for _ in range(3):
        stage.stop()
    assert stage.position_mm == before_mm
    stage.move_to(middle_mm(stage), TIMEOUT_S)


def test_stop_from_another_thread_ends_the_move(stage: Stage, candidate: Candidate) -> None:
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
        assert not candidate.brakes
        assert failures
        stage.home()
        stopped_mm = stage.position_mm
    candidate.clock.sleep_s(1.0)
    assert stage.position_mm == stopped_mm
    assert all(isinstance(f, StageAlarmError) and f.code == "stopped" for f in failures)
    assert failures or stopped_mm == pytest.approx(far_mm, abs=candidate.tolerance_mm)


def test_a_sweep_runs_over_it(stage: Stage, candidate: Candidate) -> None:
    near_mm, far_mm = stage.travel_mm
    distances_mm = [near_mm + share * (far_mm - near_mm) for share in (0.0, 0.3, 0.6, 1.0)]
    stops = plan_stops(
        distances_mm, holdout_every=0, backward_every=2, travel_mm=stage.travel_mm, stage="stage"
    )
    taken = run_sweep(
        stops,
        stage=stage,
        camera=Witness(candidate.clock, lambda: math.nan),
        clock=candidate.clock,
        samples=2,
        settle_s=0.1,
        move_timeout_s=TIMEOUT_S,
        grab_timeout_s=1.0,
        times=SweepTimes(),
    )
    for sample in taken:
        wanted_mm = sample.stop.distance_mm
        assert sample.reached_mm == pytest.approx(wanted_mm, abs=candidate.tolerance_mm)


def test_after_opening_again_only_a_kept_reference_counts(candidate: Candidate) -> None:
    with candidate.stage as stage:
        stage.home()
        stage.move_to(middle_mm(stage), TIMEOUT_S)
        before_mm = stage.position_mm
    with candidate.stage as stage:
        if candidate.is_reset_by_opening:
            with pytest.raises(StageAlarmError, match="home"):
                _ = stage.position_mm
            stage.home()
        else:
            assert stage.position_mm == before_mm
        stage.move_to(middle_mm(stage), TIMEOUT_S)
