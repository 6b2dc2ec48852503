"""The simulated board follows a stage that is no simulation."""

from types import TracebackType
from typing import Self

import pytest
from rig_sim.rehearsal import RehearsedStage
from rig_sim.world import World

from rig.errors import DeviceLostError, StageAlarmError
from rig.profile import CarriageConfig
from tests.support.cameras import SMALL, SmallRig
from tests.support.stages import TIMEOUT_S, simulated_bench

CARRIAGE = CarriageConfig(board_at_machine_zero_mm=1203.0, power_up_mm=-350.0, scale=1.001)


class Reports:
    """A stage that says what it is told to, and asks back in the middle of a move."""

    def __init__(self) -> None:
        self.says_mm: float | None = None
        self.asked = 0
        self.stopped = 0
        self.board: RehearsedStage | None = None
        self.seen_in_move_mm: float | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.asked = -1000

    identity = {"kind": "reports"}  # noqa: RUF012
    travel_mm = (400.0, 1200.0)

    @property
    def position_mm(self) -> float:
        self.asked += 1
        if self.says_mm is None:
            raise StageAlarmError("stage", "the position is not known", advice="home", code="")
        return self.says_mm

    def home(self) -> None:
        self.says_mm = 400.0

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        assert self.board is not None
        self.seen_in_move_mm = self.board.travelled_mm(0.0)
        self.says_mm = position_mm + 0.25
        return self.says_mm

    def stop(self) -> None:
        self.stopped += 1


def rehearsed() -> tuple[RehearsedStage, Reports]:
    reports = Reports()
    reports.board = RehearsedStage(reports, CARRIAGE)
    return reports.board, reports


def test_the_board_stands_at_the_scale_of_the_world_times_what_is_reported():
    stage, reports = rehearsed()
    with stage:
        assert stage.travelled_mm(0.0) == -350.0  # nobody knows yet: as when power came
        stage.home()
        assert 1203.0 + stage.travelled_mm(0.0) == pytest.approx(1.001 * 400.0, abs=1e-9)
        assert stage.move_to(600.0, 1.0) == 600.25
        assert reports.seen_in_move_mm == pytest.approx(1.001 * 400.0 - 1203.0, abs=1e-9)
        assert 1203.0 + stage.travelled_mm(0.0) == pytest.approx(1.001 * 600.25, abs=1e-9)
        reports.says_mm = 700.0  # somebody turned the spindle by hand
        assert 1203.0 + stage.travelled_mm(0.0) == pytest.approx(1.001 * 700.0, abs=1e-9)
        assert stage.position_mm == 700.0
        stage.stop()
    assert reports.stopped == 1
    assert stage.travel_mm == (400.0, 1200.0)
    assert stage.identity == {"kind": "reports"}


def test_a_stage_that_gives_no_answer_leaves_the_board_where_it_was():
    stage, reports = rehearsed()
    with stage:
        stage.home()
        reports.says_mm = None
        assert stage.travelled_mm(0.0) == pytest.approx(1.001 * 400.0 - 1203.0, abs=1e-9)
        with pytest.raises(StageAlarmError):
            _ = stage.position_mm
    asked = reports.asked
    assert stage.travelled_mm(0.0) == pytest.approx(1.001 * 400.0 - 1203.0, abs=1e-9)
    assert reports.asked == asked  # a closed stage is not asked


def test_a_picture_shows_the_board_where_a_controller_on_a_wire_has_it():
    rig = SmallRig((*SMALL, "world.carriage.board_at_machine_zero_mm=210.0"))
    with simulated_bench() as bench:
        world = World(rig.profile, clock=bench.clock, carriage=rig.slide, scene="board")
        stage = RehearsedStage(bench.stage, world.config.carriage)
        world.carried_by(stage)
        with stage:
            stage.home()
            for wanted_mm in (130.0, 180.0):
                reached_mm = stage.move_to(wanted_mm, TIMEOUT_S)
                true_mm = world.true_distance_mm(bench.clock.now_s())
                assert true_mm == pytest.approx(reached_mm, abs=0.0006)
                assert reached_mm == pytest.approx(wanted_mm, abs=0.02)
    with pytest.raises(DeviceLostError):
        _ = stage.position_mm
