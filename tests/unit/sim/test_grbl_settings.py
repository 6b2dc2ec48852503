"""Settings and blocks of the simulated GRBL, each number where GRBL 1.1 has it."""

from itertools import pairwise

import pytest
from rig_sim.firmware.grbl.gcode import Block, GcodeError, Modes, parse_block
from rig_sim.firmware.grbl.report import (
    OV_EVERY,
    WCO_EVERY,
    Snapshot,
    State,
    StatusReports,
    modes_line,
    parameter_lines,
)
from rig_sim.firmware.grbl.settings import GrblSettings

from rig.profile import FirmwareConfig

AT_MM = (-10.0, -20.0, -30.0)


def settings(**changes: object) -> GrblSettings:
    values = {
        "axis": "Y", "homing_locate_mm_s": 2.0, "homing_mm_s": 30.0, "homing_pause_s": 0.125,
        "pull_off_mm": 1.5, "steps_per_mm": 320.0, "max_rate_mm_s": 40.0,
        "acceleration_mm_s2": 350.0, "travel_mm": 640.0,
    }  # fmt: skip
    return GrblSettings.of(FirmwareConfig.model_validate(values | changes))


FACTORY = [
    "$0=10", "$1=255", "$2=0", "$3=0", "$4=0", "$5=0", "$6=0", "$10=1", "$11=0.010", "$12=0.002",
    "$13=0", "$20=1", "$21=0", "$22=1", "$23=0", "$24=120.000", "$25=1800.000", "$26=125",
    "$27=1.500", "$30=1000", "$31=0", "$32=0", "$100=250.000", "$101=320.000", "$102=250.000",
    "$110=500.000", "$111=2400.000", "$112=500.000", "$120=10.000", "$121=350.000", "$122=10.000",
    "$130=200.000", "$131=640.000", "$132=200.000",
]  # fmt: skip


def test_all_settings_are_told_by_number_whole_ones_without_decimals():
    assert settings().lines() == FACTORY
    more = ["$300=grblHAL", "$302=192.168.5.1"]
    assert settings(grbl_dialect="grblhal").lines() == [*FACTORY, *more]
    assert settings(grbl_dialect="fluidnc").lines() == ["$10=1"]


@pytest.mark.parametrize(
    ("changes", "switches"),
    [
        ({}, (True, False, True)),
        ({"soft_limits": False}, (False, False, True)),
        ({"homing": False}, (False, False, False)),
        ({"hard_limits": True}, (True, True, True)),
    ],
)
def test_limits_and_homing_are_switched_by_the_profile(
    changes: dict[str, object], switches: tuple[bool, bool, bool]
):
    found = settings(**changes)
    assert (found.soft_limits, found.hard_limits, found.homing) == switches


def test_every_axis_has_limits_of_its_own():
    found = settings()
    assert [found.steps_per_mm(axis) for axis in range(3)] == [250.0, 320.0, 250.0]
    assert [found.max_rate_mm_s(axis) for axis in range(3)] == [500.0 / 60.0, 40.0, 500.0 / 60.0]
    assert [found.acceleration_mm_s2(axis) for axis in range(3)] == [10.0, 350.0, 10.0]
    assert [found.max_travel_mm(axis) for axis in range(3)] == [200.0, 640.0, 200.0]


@pytest.mark.parametrize(
    ("target_mm", "is_beyond"),
    [
        ((0.0, 0.0, 0.0), False),
        ((-200.0, -640.0, -200.0), False),
        ((0.001, 0.0, 0.0), True),
        ((0.0, 0.0, 0.001), True),
        ((-200.001, 0.0, 0.0), True),
        ((0.0, -640.001, 0.0), True),
        ((0.0, -201.0, 0.0), False),
    ],
)
def test_travel_goes_from_minus_its_length_to_zero_both_included(
    target_mm: tuple[float, float, float], is_beyond: bool
):
    assert settings().exceeds_travel(target_mm) == is_beyond


@pytest.mark.parametrize(("mask", "down"), [(0, []), (1, [0]), (2, [1]), (4, [2]), (7, [0, 1, 2])])
def test_each_bit_of_the_homing_mask_turns_one_axis(mask: int, down: list[int]):
    found = settings()
    assert found.store(f"23={mask}") == 0
    assert [axis for axis in range(3) if found.homes_down(axis)] == down


@pytest.mark.parametrize(
    ("assignment", "code"),
    [
        ("0=2", 6), ("0=2.9", 6), ("0=3", 0), ("20=1", 0), ("13=-1", 4), ("13=0", 0),
        *((f"{number}=0", 4) for number in (24, 25, 100, 101, 102, 110, 111, 112, 120, 121, 122)),
        *((f"{number}=0", 0) for number in (1, 2, 3, 4, 5, 6, 10, 11, 12, 21, 22, 23, 26, 27, 30)),
        *((f"{number}=0", 0) for number in (31, 32, 130, 131, 132)),
        *((f"{number}=5", 3) for number in (7, 9, 14, 19, 28, 33, 99, 103, 113, 123, 133)),
        ("x=1", 2), ("10", 3), ("10=", 2), ("=5", 2),
    ],
)  # fmt: skip
def test_an_assignment_is_taken_or_refused_with_grbls_number(assignment: str, code: int):
    assert settings().store(assignment) == code


@pytest.mark.parametrize(
    ("number", "stored"),
    [(1, 7.0), (26, 7.0), (30, 7.0), *((n, 7.75) for n in (11, 12, 24, 25, 27, 100, 122, 132))],
)
def test_settings_without_decimals_lose_them(number: int, stored: float):
    found = settings()
    assert found.store(f"{number}=7.75") == 0
    assert found.values[number] == stored


def test_soft_limits_need_homing_and_go_with_it():
    found = settings()
    assert found.store("22=0") == 0
    assert (found.homing, found.soft_limits) == (False, False)
    assert found.store("20=1") == 10
    assert found.store("20=0") == 0
    assert found.store("22=1") == 0
    assert (found.homing, found.soft_limits) == (True, False)
    assert found.store("20=1") == 0
    assert found.store("22=1") == 0
    assert found.soft_limits


def test_fluidnc_tells_its_tree_value_by_value():
    found = settings(grbl_dialect="fluidnc")
    told = {
        "soft_limits": "true",
        "max_rate_mm_per_min": "2400.000",
        "acceleration_mm_per_sec2": "350.000",
        "max_travel_mm": "640.000",
        "homing/mpos_mm": "0.000",
        "homing/positive_direction": "true",
    }
    for name, text in told.items():
        assert found.tree_lines(f"/axes/y/{name}") == [f"$/axes/y/{name}={text}"]
    assert found.tree_lines("/axes/x/max_travel_mm") == ["$/axes/x/max_travel_mm=200.000"]
    assert found.tree_lines("/axes/a/max_travel_mm") == []
    without = settings(grbl_dialect="fluidnc", homing=False)
    assert without.tree_lines("/axes/y/homing/mpos_mm") == []
    assert without.tree_lines("/axes/y/soft_limits") == ["$/axes/y/soft_limits=false"]


@pytest.mark.parametrize(
    ("line", "block"),
    [
        ("", Block()),
        ("G0X1", Block((1.0, -20.0, -30.0))),
        ("G1X1Y2Z3F120", Block((1.0, 2.0, 3.0), 2.0)),
        ("G91X1Z-2", Block((-9.0, -20.0, -32.0))),
        ("G20G1X1F60", Block((25.4, -20.0, -30.0), 25.4)),
        ("G53X5", Block((5.0, -20.0, -30.0))),
        ("G4P1.5", Block(dwell_s=1.5)),
        ("F60", Block()),
        ("G80", Block()),
    ],
)
def test_a_line_becomes_a_block(line: str, block: Block):
    assert parse_block(line, Modes(), AT_MM)[0] == block


def test_what_a_line_sets_holds_for_the_next():
    modes = parse_block("G1G91G20F30", Modes(), AT_MM)[1]
    assert modes == Modes(motion=1, inches=True, incremental=True, feed_mm_min=762.0)
    assert parse_block("Y1", modes, AT_MM)[0] == Block((-10.0, 5.399999999999999, -30.0), 12.7)
    assert parse_block("G0G90G21", modes, AT_MM)[1] == Modes(feed_mm_min=762.0)
    assert parse_block("", modes, AT_MM)[1] == modes


def test_an_offset_is_machine_minus_work_of_the_axes_that_are_named():
    first = parse_block("G92X5", Modes(), AT_MM)
    assert first == (Block(), Modes(offset_mm=(-15.0, 0.0, 0.0)))
    second = parse_block("G92Z-1", first[1], AT_MM)[1]
    assert second.offset_mm == (-15.0, 0.0, -29.0)
    assert parse_block("X1Z1", second, AT_MM)[0].target_mm == (-14.0, -20.0, -28.0)
    assert parse_block("G53X1Z1", second, AT_MM)[0].target_mm == (1.0, -20.0, 1.0)
    assert parse_block("G91X1Z1", second, AT_MM)[0].target_mm == (-9.0, -20.0, -29.0)


def test_a_jog_has_a_feed_of_its_own_and_leaves_no_trace():
    modes = Modes(incremental=True, feed_mm_min=999.0)
    assert parse_block("G90X1F60", modes, AT_MM, is_jog=True) == (
        Block((1.0, -20.0, -30.0), 1.0),
        modes,
    )


@pytest.mark.parametrize(
    ("line", "code", "is_jog"),
    [
        ("X1", 22, True), ("F60", 26, True), ("G0X1F60", 16, True), ("G92X1F60", 16, True),
        ("G94X1F60", 16, True), ("G53X1F0", 22, True), ("@1", 1, False), ("[1", 1, False),
        ("A1", 20, False), ("Z1Z1", 25, False), ("S-1", 4, False), ("T-0.1", 4, False),
        ("G5", 20, False), ("G90.1", 23, False), ("G20G21", 21, False), ("G54G54", 21, False),
        ("G90G91", 21, False), ("G4G92", 21, False), ("G94G94", 21, False), ("P1", 36, False),
        ("G4", 28, False), ("G92", 26, False), ("G92G0X1", 24, False), ("G1X1", 22, False),
        ("G80G53", 30, False), ("G80Y1", 31, False),
    ],
)  # fmt: skip
def test_a_line_is_refused_with_grbls_number(line: str, code: int, is_jog: bool):
    with pytest.raises(GcodeError) as caught:
        parse_block(line, Modes(), AT_MM, is_jog=is_jog)
    assert caught.value.code == code
    assert str(caught.value) == f"error:{code}"


def test_values_may_be_zero_or_negative_where_they_are_places():
    assert parse_block("F0S0T0N0", Modes(), AT_MM)[0] == Block()
    assert parse_block("X-1Y-2Z0", Modes(), AT_MM)[0].target_mm == (-1.0, -2.0, 0.0)


def snapshot(**changes: object) -> Snapshot:
    values: dict[str, object] = {
        "state": State.IDLE, "is_held": False, "position_mm": (-1.0, 2.0, 25.4),
        "offset_mm": (1.0, 0.5, 0.0), "speed_mm_s": 2.54, "free_blocks": 14, "free_bytes": 120,
        "switch": "",
    }  # fmt: skip
    return Snapshot(**(values | changes))  # pyright: ignore[reportArgumentType]


def reported(found: GrblSettings, *snapshots: Snapshot) -> list[str]:
    reports = StatusReports(found)
    reports.line(snapshot())
    reports.line(snapshot())
    return [reports.line(one) for one in snapshots or (snapshot(),)]


@pytest.mark.parametrize(
    ("mask", "fields"),
    [
        (0, "WPos:-2.000,1.500,25.400|FS:152,0"),
        (1, "MPos:-1.000,2.000,25.400|FS:152,0"),
        (2, "WPos:-2.000,1.500,25.400|Bf:14,120|FS:152,0"),
        (3, "MPos:-1.000,2.000,25.400|Bf:14,120|FS:152,0"),
    ],
)
def test_the_report_mask_chooses_coordinates_and_buffers(mask: int, fields: str):
    found = settings()
    found.store(f"10={mask}")
    assert reported(found) == [f"<Idle|{fields}>"]


def test_in_inches_positions_have_four_decimals_and_speed_is_per_inch():
    found = settings()
    found.store("13=1")
    assert reported(found) == ["<Idle|MPos:-0.0394,0.0787,1.0000|FS:6,0>"]


def test_hold_and_a_closed_switch_show():
    held, stopping = (snapshot(state=State.HOLD, is_held=is_held) for is_held in (True, False))
    lines = reported(settings(), held, stopping, snapshot(switch="Y"))
    assert [line.partition("|")[0] for line in lines] == ["<Hold:0", "<Hold:1", "<Idle"]
    assert [line.endswith("|Pn:Y>") for line in lines] == [False, False, True]


def test_only_grblhal_says_why_it_waits_in_an_alarm():
    alarm = snapshot(state=State.ALARM)
    assert reported(settings(), alarm)[0].startswith("<Alarm|")
    assert reported(settings(grbl_dialect="grblhal"), alarm)[0].startswith("<Alarm:11|")
    assert reported(settings(grbl_dialect="grblhal"))[0].startswith("<Idle|")


@pytest.mark.parametrize(
    ("state", "wco_every", "ov_every"),
    [(State.IDLE, 10, 10), (State.ALARM, 10, 10), (State.SLEEP, 10, 10), (State.CYCLE, 30, 20),
     (State.HOLD, 30, 20), (State.HOMING, 30, 20), (State.JOG, 30, 20)],
)  # fmt: skip
def test_offset_and_overrides_come_with_their_period(state: State, wco_every: int, ov_every: int):
    reports = StatusReports(settings())
    lines = [reports.line(snapshot(state=state)) for _ in range(70)]
    wco = [number for number, line in enumerate(lines) if "|WCO:1.000,0.500,0.000" in line]
    ov = [number for number, line in enumerate(lines) if "|Ov:100,100,100" in line]
    assert wco == list(range(0, 70, wco_every))
    assert all("WCO" not in lines[number] for number in ov)
    assert ov[0] == 1
    assert min(b - a for a, b in pairwise(ov)) == ov_every
    assert (WCO_EVERY[state.is_busy], OV_EVERY[state.is_busy]) == (wco_every, ov_every)


def test_parameters_and_modes_are_told():
    lines = parameter_lines((1.0, -2.5, 0.0))
    assert lines[:2] == ["[G54:0.000,0.000,0.000]", "[G55:0.000,0.000,0.000]"]
    assert len(lines) == 11
    assert lines[8:] == ["[G92:1.000,-2.500,0.000]", "[TLO:0.000]", "[PRB:0.000,0.000,0.000:0]"]
    assert modes_line(Modes()) == "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]"
    changed = Modes(motion=1, inches=True, incremental=True, feed_mm_min=90.0)
    assert modes_line(changed) == "[GC:G1 G54 G17 G20 G91 G94 M5 M9 T0 F90 S0]"
