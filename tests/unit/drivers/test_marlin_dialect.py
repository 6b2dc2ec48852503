"""From lines to values and back: what Marlin says."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_drivers.marlin.dialect import (
    Busy,
    Ok,
    Position,
    Remark,
    Reply,
    Resend,
    Start,
    Trouble,
    alarm,
    numbered_line,
    parse_reply,
)
from rig_drivers.marlin.settings import MarlinAxis, read_axis, travel_time_s
from rig_drivers.stage.dialogue import Noise
from rig_sim.motion import trapezoid

from rig.errors import ConfigError
from tests.support.word_salad import salad


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("ok", Ok(None)),
        ("ok N12 P15 B3", Ok(12, text="P15 B3")),
        ("ok T:21.0 /0.0", Ok(None, text="T:21.0 /0.0")),
        (
            "ok X:1.00 Y:2.00 Z:3.00 E:0.00 Count X:80 Y:160 Z:240",
            Ok(None, Position((1.0, 2.0, 3.0), (80, 160, 240))),
        ),
        ("Resend: 7", Resend(7)),
        ("rs N7", Resend(7)),
        ("echo:busy: processing", Busy()),
        ("busy: paused for user", Busy()),
        ("start", Start()),
        (
            "X:10.00 Y:0.00 Z:-1.50 E:0.00 Count X:800 Y:0 Z:-600",
            Position((10.0, 0.0, -1.5), (800, 0, -600)),
        ),
        ("X:1.00 Y:2.00 Z:3.00 E:0.00 Count A:80 B:80 C:0", Position((1.0, 2.0, 3.0), None)),
        (
            "X:1.00 Y:2.00 Z:3.00 E:0.00 Count X: 80 Y: 160 Z: 240",
            Position((1.0, 2.0, 3.0), (80, 160, 240)),
        ),
        ("Error:Printer halted. kill() called!", Trouble("Printer halted. kill() called!")),
        ('echo:Unknown command: "M999X"', Trouble('Unknown command: "M999X"')),
        ("echo:Home XYZ First", Trouble("Home XYZ First")),
        (
            "Error:checksum mismatch, Last Line: 6",
            Remark("Error:checksum mismatch, Last Line: 6"),
        ),
        ("Error:expected line 4 got 5", Remark("Error:expected line 4 got 5")),
        ("echo:  M203 X500.00 Y500.00", Remark("echo:  M203 X500.00 Y500.00")),
        ("ok\ufffd", Noise("ok\ufffd")),
        ("o\x07k", Noise("o\x07k")),
    ],
)  # fmt: skip
def test_what_marlin_says_is_understood(line: str, reply: Reply) -> None:
    assert parse_reply(line) == reply


def test_a_numbered_line_is_the_one_of_the_reprap_documentation() -> None:
    assert numbered_line(3, "T0") == b"N3 T0*57\n"
    assert numbered_line(4, "G92 E0") == b"N4 G92 E0*67\n"


@given(st.binary(max_size=100))
def test_any_bytes_give_a_value(data: bytes) -> None:
    assert isinstance(parse_reply(data.decode("ascii", errors="replace")), Reply)


WORDS = [
    "ok", " ", "N1", "Resend:", "rs", "busy:", "echo:", "X:", "Y:", "Z:", "E:", "1.00", "-2.00",
    "Count", "A:", "Error:", "start", "\ufffd", "first", "Home ", "Unknown command: ",
]  # fmt: skip


LINES = [
    "ok N12 P15 B3",
    "Resend: 7",
    "X:10.00 Y:0.00 Z:-1.50 E:0.00 Count X:800 Y:0 Z:-600",
    "Error:checksum mismatch, Last Line: 6",
    "echo:busy: processing",
]


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32))
def test_a_hundred_thousand_bad_lines_give_values(seed: int) -> None:
    for line in salad(seed, WORDS, LINES):
        assert isinstance(parse_reply(line), Reply)


@pytest.mark.parametrize(
    ("said", "code"),
    [
        ("Printer halted. kill() called!", "killed"),
        ("Printer stopped due to errors. Fix the error and use M999", "stopped by error"),
        ("Home X First", "not homed"),
        ('Unknown command: "G99"', "unknown command"),
        ("Thermal Runaway, system stopped! Heater_ID: bed", "failing"),
        ("Heater ID: E0 MINTEMP triggered", "failing"),
        ("MAXTEMP triggered, system stopped! Heater_ID: 0", "failing"),
        ("Heating failed, system stopped! Heater_ID: 0", "failing"),
        ("Heating Failed, system stopped! Heater_ID: E0", "failing"),
        ("Homing Failed", "failing"),
        ("KILL caused by KILL button/pin", "failing"),
        ('// Unknown command:"M115"', "Klipper"),
        ("something else", "error"),
    ],
)
def test_troubles_say_what_to_do(said: str, code: str) -> None:
    error = alarm("stage", said)
    assert error.code == code
    assert error.found == f"stage: {said.rstrip('.')}"
    assert error.advice


# -- settings -------------------------------------------------------------------------------------

M503 = [
    "echo:  M92 X400.00 Y80.00 Z400.00 E500.00",
    "echo:  M203 X100.00 Y300.00 Z5.00 E25.00",
    "echo:  M201 X500.00 Y3000.00 Z100.00 E10000.00",
    "echo:  M204 P3000.00 R3000.00 T400.00",
]
M211 = ["echo:  M211 S1 ; ON", "echo:  Min:  X0.00 Y0.00 Z0.00   Max:  X820.00 Y200.00 Z180.00"]
OLD_M211 = ["echo:Soft endstops: On  Min:  X0.00 Y0.00 Z0.00   Max:  X820.00 Y200.00 Z180.00"]


@pytest.mark.parametrize("soft", [M211, OLD_M211])
def test_settings_of_an_axis_are_found(soft: list[str]) -> None:
    x = read_axis([*M503, *soft], "X", device="stage")
    assert x == MarlinAxis(100.0, 400.0, 400.0, (0.0, 820.0))
    z = read_axis([*M503, *soft], "Z", device="stage")
    assert z == MarlinAxis(5.0, 100.0, 400.0, (0.0, 180.0))


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ([*M503, "echo:  M211 S0 ; OFF"], "soft end stops are off"),
        ([*M503[1:], *M211], "tells no steps of axis X"),
        ([*M503[:1], *M211], "tells no axis acceleration, rate, travel acceleration of axis X"),
        ([*M503[:3], "echo:  M204 P1.00 R1.00 T0.00", *M211], "set M201, M204 T and M92 above 0"),
    ],
)
def test_settings_that_are_not_safe_are_refused(lines: list[str], expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        read_axis(lines, "X", device="stage")


@pytest.mark.parametrize("way_mm", [0.0, 0.5, 15.9, 16.1, 300.0])
def test_the_time_of_a_move_is_that_of_the_kinematics(way_mm: float) -> None:
    phases = trapezoid(0.0, 0.0, way_mm, speed_mm_s=80.0, acceleration_mm_s2=400.0)
    end_s = phases[-1].end_s if phases else 0.0
    assert travel_time_s(way_mm, 80.0, 400.0) == pytest.approx(end_s)
