"""Places of the unknowns, steps of them, and what is known of them before any picture."""

import numpy as np
import pytest

from rig.geometry.bundle.linearise import Target
from rig.geometry.bundle.priors import StageStops, pull_of_shared, stage_rows
from rig.geometry.bundle.unknowns import Free, StageLine, Unknowns, lay_out
from rig.targets.checkerboard import Checkerboard
from tests.support.calibration_scene import turn

TARGET = Target(Checkerboard(5, 4, 10.0).points_mm.reshape(-1, 3))


def unknowns(stage: StageLine | None = None) -> Unknowns:
    return Unknowns(
        lenses=("none", "brown5", "fisheye"),
        intrinsics=(np.full(4, 500.0), np.arange(9.0), np.arange(8.0) / 10),
        view_rotation=np.stack([turn((k, 2 * k, 0.0)) for k in range(3)]),
        view_shift_mm=np.arange(9.0).reshape(3, 3),
        warp_mm=np.array([0.1, -0.2, 0.3]),
        board_rotation=np.stack([turn((5.0, 3.0 * k, 1.0)) for k in range(2)]),
        board_shift_mm=np.array([[1.0, 2.0, 500.0], [3.0, 4.0, 600.0]]),
        stage=stage,
    )


def line() -> StageLine:
    axis = np.array([0.6, 0.0, 0.8])
    return StageLine(turn((5.0, 0.0, 1.0)), np.array([1.0, 2.0, 550.0]), axis, 1.5, 20.0)


def test_columns_are_numbered_by_view_then_place_then_warp_then_stage() -> None:
    found = lay_out(("none", "brown5", "fisheye"), 1, Free(), stage=True)
    assert found.view_columns.tolist() == [
        [*range(4), *[-1] * 5, *range(21, 27)],
        [*range(4, 13), *[-1] * 6],
        [*range(13, 21), -1, *range(27, 33)],
    ]
    assert found.warp_columns.tolist() == [33, 34, 35]
    assert found.stage_columns.tolist() == list(range(36, 45))
    assert found.count == 45
    assert found.sighting_columns[0].tolist() == [*found.view_columns[0], 33, 34, 35]


@pytest.mark.parametrize(
    ("free", "count"),
    [
        (Free(), 4 + 9 + 8 + 12 + 3 + 9),
        (Free(lens=False), 12 + 12 + 3 + 9),
        (Free(intrinsics=False), 12 + 3 + 9),
        (Free(places=False), 21 + 3 + 9),
        (Free(warp=False), 33 + 9),
        (Free(stage=False), 36),
        (Free(False, False, False, False, False), 0),
    ],
)
def test_what_is_fixed_has_no_column(free: Free, count: int) -> None:
    found = lay_out(("none", "brown5", "fisheye"), 0, free, stage=True)
    columns = np.concatenate([found.view_columns.ravel(), found.warp_columns, found.stage_columns])
    assert sorted(columns[columns >= 0].tolist()) == list(range(count))
    assert found.count == count
    without = lay_out(("none", "brown5", "fisheye"), 0, free, stage=False)
    assert without.count == count - (9 if free.stage else 0)


def test_a_step_moves_what_its_columns_say() -> None:
    at = unknowns(line())
    layout = lay_out(at.lenses, 0, Free(), stage=True)
    step = np.linspace(-0.01, 0.02, layout.count)
    boards = np.linspace(-0.03, 0.01, 12).reshape(2, 6)
    found = at.moved(layout, step, boards)
    assert np.concatenate(found.intrinsics) == pytest.approx(
        np.concatenate(at.intrinsics) + step[:21]
    )
    for view, start in ((1, 21), (2, 27)):
        turned = turn(np.degrees(step[start : start + 3])) @ at.view_rotation[view]
        assert found.view_rotation[view] == pytest.approx(turned, abs=1e-12)
        shift = at.view_shift_mm[view] + step[start + 3 : start + 6]
        assert found.view_shift_mm[view] == pytest.approx(shift)
    assert found.view_rotation[0] == pytest.approx(at.view_rotation[0], abs=1e-15)
    assert found.view_shift_mm[0].tolist() == at.view_shift_mm[0].tolist()
    assert found.warp_mm == pytest.approx(at.warp_mm + step[33:36])
    for n in range(2):
        turned = turn(np.degrees(boards[n, :3])) @ at.board_rotation[n]
        assert found.board_rotation[n] == pytest.approx(turned, abs=1e-12)
        assert found.board_shift_mm[n] == pytest.approx(at.board_shift_mm[n] + boards[n, 3:])
    assert found.stage is not None
    assert found.stage.origin_mm == pytest.approx(line().origin_mm + step[39:42])
    assert found.stage.scale == pytest.approx(1.5 + step[44])


@pytest.mark.parametrize("axis", [(0.6, 0.0, 0.8), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0, 0)])
def test_an_axis_turns_to_what_lies_across(axis: tuple[float, float, float]) -> None:
    stage = StageLine(np.eye(3), np.zeros(3), np.array(axis), 1.0, 0.0)
    frame = np.stack([*stage.across, stage.axis])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    step = np.array([0, 0, 0, 0, 0, 0, 0.3, 0.4, 0.25])
    moved = stage.moved(step)
    across = 0.3 * stage.across[0] + 0.4 * stage.across[1]
    assert moved.axis == pytest.approx((stage.axis + across) / np.sqrt(1.25))
    assert moved.scale == 1.25
    assert moved.rotation == pytest.approx(np.eye(3), abs=1e-15)


def test_boards_shown_are_moved_by_each_views_motion() -> None:
    at = unknowns()
    picture = np.array([0, 1, 1])
    rotation, shift_mm = at.boards_shown(picture)
    assert np.array_equal(rotation, at.board_rotation[picture])
    assert np.array_equal(shift_mm, at.board_shift_mm[picture])
    motion = np.linspace(-0.1, 0.1, 18).reshape(3, 6)
    layout = lay_out(at.lenses, 0, Free(), stage=False)
    moving = at.moved(layout, np.zeros(layout.count), np.zeros((2, 6)), motion)
    rotation, shift_mm = moving.boards_shown(picture)
    for s in range(3):
        turned = turn(np.degrees(motion[s, :3])) @ at.board_rotation[picture[s]]
        assert rotation[s] == pytest.approx(turned, abs=1e-12)
        assert shift_mm[s] == pytest.approx(at.board_shift_mm[picture[s]] + motion[s, 3:])
    kept = moving.with_boards(np.array([False, True]), np.array([False, True, True]))
    assert kept.motion is not None
    assert kept.motion.tolist() == motion[1:].tolist()
    assert kept.board_shift_mm.tolist() == [[3.0, 4.0, 600.0]]
    assert np.array_equal(kept.board_rotation, at.board_rotation[1:])


def test_a_target_is_bent_over_its_own_extent() -> None:
    assert TARGET.centre_mm.tolist() == [20.0, 15.0]
    assert TARGET.half_mm.tolist() == [20.0, 15.0]
    one_row = Target(np.array([[0.0, 3.0, 0.0], [10.0, 3.0, 0.0]]))
    assert one_row.half_mm.tolist() == [5.0, 1.0]
    assert TARGET.bending[[0, 2, 4, 19]].tolist() == [[1, 1, 1], [0, 0, 1], [1, -1, 1], [1, 1, 1]]
    bent = TARGET.bent_mm(np.array([0.5, 0.25, 2.0]))
    assert bent[[0, 2, 4], 2].tolist() == [2.75, 2.0, 2.25]
    assert bent[:, :2].tolist() == TARGET.points_mm[:, :2].tolist()


def test_lenses_are_held_near_none_and_boards_near_flat() -> None:
    at = unknowns()
    layout = lay_out(at.lenses, 0, Free(), stage=False)
    pull = pull_of_shared(at, layout, TARGET)
    lens = [*range(8, 13), *range(17, 21)]
    information = np.zeros(layout.count)
    information[lens] = 1.0
    information[33:36] = 0.1**-2  # half a per cent of 20 mm
    assert pull.information == pytest.approx(information)
    values = np.concatenate([at.intrinsics[1][4:], at.intrinsics[2][4:]])
    side = np.zeros(layout.count)
    side[lens] = -values
    side[33:36] = -100.0 * at.warp_mm
    assert pull.side == pytest.approx(side)
    assert pull.cost == pytest.approx(values @ values + 100.0 * at.warp_mm @ at.warp_mm)


def test_stops_have_a_middle_and_rows_that_are_first_differences() -> None:
    assert StageStops(np.arange(3), np.array([10.0, 70.0, 20.0])).middle_mm == 40.0
    stops = StageStops(np.array([0, 1]), np.array([12.0, 45.0]))
    at = unknowns(line())
    layout = lay_out(at.lenses, 0, Free(), stage=True)
    rows = stage_rows(at, stops)
    sigma = np.repeat([5e-5, 5e-3], 3)
    assert rows.by_pose == pytest.approx(1 / sigma)
    for k, position in enumerate(stops.position_mm):
        wanted = line().origin_mm + 1.5 * (position - 20.0) * line().axis
        shift = (wanted - at.board_shift_mm[k]) / 5e-3
        assert rows.residual[k, 3:] == pytest.approx(shift, rel=1e-12)
    turned = at.board_rotation[1] @ line().rotation.T
    assert rows.residual[0, :3] == pytest.approx(np.zeros(3), abs=1e-9)
    angle = np.arccos((np.trace(turned) - 1) / 2)
    assert np.linalg.norm(rows.residual[1, :3]) * 5e-5 == pytest.approx(angle, rel=1e-9)
    for number in range(9):
        step = np.zeros(layout.count)
        step[layout.stage_columns[number]] = 1e-5
        ahead, back = (
            stage_rows(at.moved(layout, sign * step, np.zeros((2, 6))), stops).residual
            for sign in (1.0, -1.0)
        )
        change = (back - ahead) / 2e-5
        # The turn's derivative is that of boards near the line: not of the second, 3 degrees off.
        assert rows.by_stage[0, :, number] == pytest.approx(change[0], rel=1e-5, abs=1e-3)
        assert rows.by_stage[1, 3:, number] == pytest.approx(change[1, 3:], rel=1e-5, abs=1e-3)
