"""From lines to values: the words of GRBL 1.1, its dialects, and anything else."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_drivers.grbl.dialect import (
    Alarm,
    Banner,
    Dialect,
    Message,
    Ok,
    Refused,
    Reply,
    Setting,
    Status,
    alarm,
    parse_reply,
    refusal,
)
from rig_drivers.stage.dialogue import Noise

from tests.support.word_salad import salad

HOME = (-2.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("ok", Ok()),
        ("error:9", Refused(9)),
        ("ALARM:2", Alarm(2)),
        ("Grbl 1.1h ['$' for help]", Banner("1.1h")),
        ("GrblHAL 1.1f ['$' or '$HELP' for help]", Banner("1.1f", Dialect.GRBLHAL)),
        ("Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]", Banner("3.7", Dialect.FLUIDNC)),
        ("$130=820.000", Setting(130, 820.0)),
        ("$110=500.000 (x max rate, mm/min)", Setting(110, 500.0)),
        ("$302=192.168.5.1", Message("302", "192.168.5.1")),
        ("$/axes/x/homing/mpos_mm=0.000", Message("/axes/x/homing/mpos_mm", "0.000")),
        ("<Alarm:11|MPos:-2.000,0.000,0.000|H:0>", Status("Alarm:11", HOME, None, None)),
        ("[VER:1.1h.20190830:]", Message("VER", "1.1h.20190830:")),
        ("[MSG:'$H'|'$X' to unlock]", Message("MSG", "'$H'|'$X' to unlock")),
        ("<Idle|MPos:-2.000,0.000,0.000|FS:0,0>", Status("Idle", HOME, None, None)),
        (
            "<Hold:1|WPos:-2.000,0.000,0.000|Bf:15,128|FS:0,0|Pn:XZ|WCO:-2.000,0.000,0.000>",
            Status("Hold:1", None, HOME, HOME),
        ),
        (
            "<Run|MPos:-2.000,0.000,0.000,7.000|Ov:100,100,100|A:SF|TLR:0>",
            Status("Run", (*HOME, 7.0), None, None),
        ),
    ],
)
def test_what_grbl_says_is_understood(line: str, reply: Reply) -> None:
    assert parse_reply(line) == reply


@pytest.mark.parametrize(
    "line",
    [
        "",
        "okok",
        "ALARM:",
        "error:x",
        "Grbl",
        "<Idle>",
        "<Idle|FS:0,0>",
        "<Idle|MPos:-2.000,0.000|FS:0,0>",
        "<Idle|MPos:-2.00,0.000,0.000|FS:0,0>",
        "<Idle|MPos:-2.0000,0.0000,0.0000|FS:0,0>",
        "<Idle|MPos:-2.000,0.000,0.000|MPos:-3.000,0.000,0.000>",
        "<Idle|MPos:-2.000,0.000,0.000|WPos:-3.000,0.000,0.000>",
        "<Idle|MPos:-2.000,0.000,0.000|FS:0,0",
        "<Idle|MPos:-2.000,0.0\ufffd0,0.000|FS:0,0>",
        "<Idle|MPos:-2.000,0.000,0.000|WCO:1,2,3>",
        "<Idle|MPos:\u0661.000,0.000,0.000|FS:0,0>",
    ],
)
def test_damaged_lines_are_noise(line: str) -> None:
    assert parse_reply(line) == Noise(line)


@given(st.binary(max_size=100))
def test_any_bytes_give_a_value(data: bytes) -> None:
    assert isinstance(parse_reply(data.decode("ascii", errors="replace")), Reply)


WORDS = [
    "<", ">", "|", "Idle", "MPos:", "WCO:", "-2.000", ",", "ok", "error:", "9", "$", "=", "[",
    "]", ":", "Grbl ", "1.1h", "ALARM:",
]  # fmt: skip
LINES = [
    "<Hold:1|WPos:-2.000,0.000,0.000|Bf:15,128|FS:0,0|Pn:XZ|WCO:-2.000,0.000,0.000>",
    "Grbl 1.1h ['$' for help]",
    "$110=500.000 (x max rate, mm/min)",
    "[MSG:'$H'|'$X' to unlock]",
    "ALARM:1",
]


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32))
def test_a_hundred_thousand_bad_lines_give_values(seed: int) -> None:
    for line in salad(seed, WORDS, LINES):
        assert isinstance(parse_reply(line), Reply)


@given(st.lists(st.integers(-999_999, 999_999), min_size=3, max_size=3))
def test_positions_are_read_exactly(microns: list[int]) -> None:
    text = ",".join(f"{value / 1000:.3f}" for value in microns)
    reply = parse_reply(f"<Idle|MPos:{text}|FS:0,0>")
    assert isinstance(reply, Status)
    assert reply.machine_mm == tuple(value / 1000 for value in microns)


def test_versions_compare_as_numbers() -> None:
    assert Banner("0.9j").number < (1, 1) <= Banner("1.1h").number < Banner("10.2").number


@pytest.mark.parametrize("code", [*range(1, 10), 98])
def test_alarms_say_what_to_do(code: int) -> None:
    error = alarm("stage", code)
    assert error.found.startswith(f"stage: ALARM:{code}: ")
    assert error.code == f"ALARM:{code}"
    assert error.advice


@pytest.mark.parametrize("code", [1, 2, 3, 5, 8, 9, 15, 20, 22, 77])
def test_refusals_have_a_reason(code: int) -> None:
    error = refusal("stage", "G0", code)
    assert error.found.startswith(f"stage: G0 was refused, error:{code}: ")
    assert error.code == f"error:{code}"
    assert error.advice


@pytest.mark.parametrize(("dialect", "last"), [(Dialect.GRBLHAL, 21), (Dialect.FLUIDNC, 18)])
def test_every_alarm_of_a_dialect_has_words(dialect: Dialect, last: int) -> None:
    found = [alarm("stage", code, dialect).found for code in range(1, last + 2)]
    assert all("unknown" not in text for text in found[:-1])
    assert "unknown alarm" in found[-1]
