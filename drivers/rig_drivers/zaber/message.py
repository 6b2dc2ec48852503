"""Messages of the Zaber ASCII protocol: pure functions between text and values.

Source: Zaber ASCII protocol manual, firmware 6 and 7.
"""

import re
from dataclasses import dataclass

from rig_drivers.stage.dialogue import Noise


@dataclass(frozen=True, slots=True)
class Answer:
    """`@`: the reply to a command."""

    address: int
    axis: int
    """0: the whole device."""
    number: int | None
    """The command's message id, if it had one."""
    is_taken: bool
    """`OK`; a motion has begun, not ended. Otherwise `RJ`, and `data` is the reason."""
    is_busy: bool
    """Whether the axis, or any axis of the device, moves."""
    flag: str
    """Warning flag of the highest priority, `--` for none."""
    data: str
    has_checksum: bool


@dataclass(frozen=True, slots=True)
class Alert:
    """`!`: something happened without a command."""

    address: int
    axis: int
    is_busy: bool
    flag: str
    has_checksum: bool


@dataclass(frozen=True, slots=True)
class Info:
    """`#`: a comment for people."""

    text: str


Message = Answer | Alert | Info | Noise

_CHECKSUM = re.compile(r"(.*):([0-9A-F]{2})", re.ASCII)
_ANSWER = re.compile(
    r"@(\d\d) (\d)(?: (\d\d))? (OK|RJ) (IDLE|BUSY) (--|[A-Z]{2})(?: (.*))?", re.ASCII
)
_ALERT = re.compile(r"!(\d\d) (\d) (IDLE|BUSY) (--|[A-Z]{2})(?: .*)?", re.ASCII)


def checksum(text: str) -> str:
    """Return the two's complement of the byte sum of `text`, as two digits.

    Args:
        text: what stands between the first character of a message and the colon.
    """
    return f"{-sum(text.encode('ascii', errors='replace')) & 0xFF:02X}"


def command_line(address: int, axis: int, number: int | None, text: str) -> bytes:
    """Return a command as it goes over the wire, with its checksum.

    Args:
        address: the device; 0 means all.
        axis: the axis; 0 means all.
        number: message id 0..99, None for a command whose answer nobody waits for.
        text: such as `move abs 1000`; empty asks for the state.
    """
    words = [str(address), str(axis), "--" if number is None else str(number), *text.split()]
    body = " ".join(words)
    return f"/{body}:{checksum(body)}\n".encode("ascii")


def parse_message(line: str) -> Message:
    """Return what a line means; a wrong checksum or anything else is `Noise`, no exception."""
    text, has_checksum = line, False
    if found := _CHECKSUM.fullmatch(line):
        text, has_checksum = found[1], True
        if checksum(text[1:]) != found[2]:
            return Noise(line)
    if found := _ANSWER.fullmatch(text):
        number = None if found[3] is None else int(found[3])
        return Answer(
            int(found[1]),
            int(found[2]),
            number,
            is_taken=found[4] == "OK",
            is_busy=found[5] == "BUSY",
            flag=found[6],
            data=found[7] or "",
            has_checksum=has_checksum,
        )
    if found := _ALERT.fullmatch(text):
        return Alert(int(found[1]), int(found[2]), found[3] == "BUSY", found[4], has_checksum)
    return Info(text[1:]) if text.startswith("#") else Noise(line)
