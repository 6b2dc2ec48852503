"""From lines to values and back: the Zaber ASCII protocol."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_drivers.stage.dialogue import Noise
from rig_drivers.zaber.message import (
    Alert,
    Answer,
    Info,
    Message,
    checksum,
    command_line,
    parse_message,
)
from rig_drivers.zaber.words import alarm, refusal

from tests.support.word_salad import salad


def answer(**changes: object) -> Answer:
    values: dict[str, object] = {
        "address": 1, "axis": 0, "number": None, "is_taken": True, "is_busy": False, "flag": "--",
        "data": "0", "has_checksum": False,
    }  # fmt: skip
    return Answer(**(values | changes))  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("@01 0 OK IDLE -- 0", answer()),
        ("@01 0 OK IDLE WR 0", answer(flag="WR")),
        (
            "@12 3 07 OK BUSY NI 1200",
            answer(address=12, axis=3, number=7, is_busy=True, flag="NI", data="1200"),
        ),
        ("@01 1 RJ IDLE -- BADDATA", answer(axis=1, is_taken=False, data="BADDATA")),
        ("@01 1 42 OK IDLE FS 02 FS WR", answer(axis=1, number=42, flag="FS", data="02 FS WR")),
        ("!01 1 IDLE --", Alert(1, 1, is_busy=False, flag="--", has_checksum=False)),
        ("#01 0 Visit the manual", Info("01 0 Visit the manual")),
    ],
)
def test_what_a_device_says_is_understood(line: str, message: Message) -> None:
    assert parse_message(line) == message


def test_the_sum_of_a_message_and_its_checksum_is_zero() -> None:
    line = command_line(1, 2, 7, "move abs 1000").decode()
    assert line.startswith("/1 2 7 move abs 1000:")
    body, _, check = line[1:].strip().partition(":")
    assert (sum(body.encode()) + int(check, 16)) % 256 == 0


def test_a_command_whose_answer_nobody_waits_for_has_no_number() -> None:
    assert command_line(1, 1, None, "stop").startswith(b"/1 1 -- stop:")
    assert command_line(0, 0, 3, "").startswith(b"/0 0 3:")


@pytest.mark.parametrize(
    "line",
    [
        "",
        "@",
        "@01 0 OK IDLE",
        "@1 0 OK IDLE -- 0",
        "@01 0 OK MOVING -- 0",
        "@01 0 100 OK IDLE -- 0",
        "@01 0 OK IDLE -- 0:00",
        "@01 0 ok IDLE -- 0",
        "@01 0 OK IDLE \ufffd- 0",
        "/1 0 OK IDLE -- 0",
    ],
)
def test_damaged_lines_are_noise(line: str) -> None:
    assert parse_message(line) == Noise(line)


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=40), st.data())
def test_one_changed_byte_never_passes_the_checksum(data: str, draw: st.DataObject) -> None:
    body = f"01 1 07 OK IDLE -- {data}"
    line = f"@{body}:{checksum(body)}"
    at = draw.draw(st.integers(1, len(body)))
    others = st.characters(min_codepoint=32, max_codepoint=126, exclude_characters=line[at])
    damaged = line[:at] + draw.draw(others) + line[at + 1 :]
    assert isinstance(parse_message(damaged), Noise)


WORDS = [
    "@",
    "!",
    "#",
    "01",
    " ",
    "1",
    "OK",
    "RJ",
    "IDLE",
    "BUSY",
    "--",
    "WR",
    ":",
    "7F",
    "-5",
    ".",
]


def parses(text: str) -> None:
    message = parse_message(text)
    assert isinstance(message, Answer | Alert | Info | Noise)


@given(st.binary(max_size=90))
def test_any_bytes_give_a_value(data: bytes) -> None:
    parses(data.decode("ascii", errors="replace"))


LINES = [
    "@01 1 42 OK IDLE FS 02 FS WR:7B",
    "@12 3 07 OK BUSY NI 1200",
    "!01 1 IDLE --:96",
    "@01 1 RJ IDLE -- BADDATA",
]


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32))
def test_a_hundred_thousand_bad_lines_give_values(seed: int) -> None:
    for line in salad(seed, WORDS, LINES):
        parses(line)


@pytest.mark.parametrize("flag", ["FS", "FO", "FD", "WR", "NI", "NC", "WL", "XX"])
def test_flags_say_what_to_do(flag: str) -> None:
    error = alarm("stage", "moved", flag)
    assert error.found.startswith(f"stage: moved, found {flag}: ")
    assert error.code == flag
    assert error.advice


@pytest.mark.parametrize("reason", ["BADDATA", "DRIVERDISABLED", "AGAIN", "ODD"])
def test_refusals_say_why(reason: str) -> None:
    error = refusal("stage", "home", reason)
    assert error.found.startswith(f"stage: `home` was refused, RJ {reason}: ")
    assert error.code == reason
    assert error.advice
