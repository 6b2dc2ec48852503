"""What Marlin says, as values: pure functions from one line of text, and numbered lines for it.

Source: Marlin 2 G-code reference and its serial messages; RepRap line numbers and checksums.
"""

import re
from dataclasses import dataclass
from functools import reduce

from rig.errors import DeviceNotFoundError, StageAlarmError
from rig_drivers.stage.dialogue import Noise

AXES = "XYZ"


@dataclass(frozen=True, slots=True)
class Ok:
    """A command was taken; a motion is queued, not done."""

    number: int | None
    """Number of its line, where the firmware tells it."""
    position: "Position | None" = None
    """What some firmwares say in the same line."""
    text: str = ""
    """The same, where it is no position: Klipper tells its name so."""


@dataclass(frozen=True, slots=True)
class Resend:
    """A line came damaged or out of order; `number` is the one expected next."""

    number: int


@dataclass(frozen=True, slots=True)
class Busy:
    """A command is still at work."""


@dataclass(frozen=True, slots=True)
class Start:
    """The controller has just started."""


@dataclass(frozen=True, slots=True)
class Trouble:
    """`Error:`, or a command that was not carried out."""

    text: str


@dataclass(frozen=True, slots=True)
class Position:
    """The answer to M114."""

    logical_mm: tuple[float, ...]
    steps: tuple[int, ...] | None
    """Counts of the motors; None where motors are no axes (CoreXY)."""
    axes: str = AXES
    """Letters of the axes, one to nine, in the order of the numbers."""


@dataclass(frozen=True, slots=True)
class Remark:
    """Any other line of text."""

    text: str


Reply = Ok | Resend | Busy | Start | Trouble | Position | Remark | Noise

_OK = re.compile(r"ok(?: N(\d{1,9}))?(?: (.*))?", re.ASCII)
_RESEND = re.compile(r"(?:Resend:|rs) ?N?(\d{1,9})", re.ASCII)
_LETTER = "[XYZABCUVWIJK]"
_NUMBER = r"-?\d{1,6}\.\d{2,4}"
_STEPS = r"-?\d{1,9}"
_POSITION = re.compile(
    rf"(X:{_NUMBER}(?: {_LETTER}:{_NUMBER}){{0,8}})(?: E:-?[\d.]+)?"
    rf"(?: Count ({_LETTER}: ?{_STEPS}(?: {_LETTER}: ?{_STEPS}){{0,8}}))?\s*",
    re.ASCII,
)
_COORDINATE = re.compile(rf"({_LETTER}): ?(-?[\d.]+)", re.ASCII)
# Klipper complains behind `!!`, and behind `//`, as Marlin speaks to a host, but in other words.
# A Marlin that halts because it found no switch says so in an echo.
_NOT_DONE = re.compile(
    r"(?:echo:)?(Unknown command: .*|Home .* [Ff]irst|STOP called .*|(?:Homing|Probing) [Ff]ailed.*"
    r"|!! .*|// (?:Unknown command:|Klipper state|Printer is ).*)"
)
_RESENDS = re.compile(
    r"\s*(checksum mismatch|missing checksum|no checksum with line number"
    r"|no line number with checksum|line number is not|expected line)",
    re.ASCII | re.IGNORECASE,
)


def numbered_line(number: int, text: str) -> bytes:
    """Return a command with its line number and the exclusive-or of its bytes."""
    body = f"N{number} {text}".encode("ascii")
    return body + f"*{reduce(lambda a, b: a ^ b, body)}\n".encode("ascii")


def parse_reply(line: str) -> Reply:
    """Return what a line means; never raises."""
    if "\ufffd" in line or not line.isprintable():
        return Noise(line)
    text = line.strip()
    if found := _OK.fullmatch(text):
        number = None if found[1] is None else int(found[1])
        position = _position(found[2] or "")
        return Ok(number, position, "" if position else (found[2] or ""))
    if found := _RESEND.fullmatch(text):
        return Resend(int(found[1]))
    if text.removeprefix("echo:").startswith("busy:"):
        return Busy()
    if text == "start":
        return Start()
    if position := _position(text):
        return position
    if text.startswith("Error:"):
        fault = text.removeprefix("Error:")
        # The request to send again follows and says all that is needed.
        return Remark(text) if _RESENDS.match(fault) else Trouble(fault)
    if "stopped due to errors" in text:
        return Trouble(text.removeprefix("echo:"))
    if found := _NOT_DONE.fullmatch(text):
        return Trouble(found[1])
    return Remark(text)


def _position(text: str) -> Position | None:
    found = _POSITION.fullmatch(text)
    if found is None:
        return None
    pairs = _COORDINATE.findall(found[1])
    axes = "".join(letter for letter, _ in pairs)
    logical_mm = tuple(float(number) for _, number in pairs)
    if len(set(axes)) != len(axes):
        return None
    if found[2] is None:
        return Position(logical_mm, None, axes)
    counts = _COORDINATE.findall(found[2])
    motors = "".join(letter for letter, _ in counts)
    if motors == axes:
        return Position(logical_mm, tuple(int(count) for _, count in counts), axes)
    # Motors A and B on axes X and Y are a CoreXY; letters that are only too few are a damaged line.
    return None if set(motors) <= set(axes) else Position(logical_mm, None, axes)


KILLED = "killed"
FAILING = "failing"
KLIPPER = "Klipper"
_OFF_AND_ON = "clear its cause, switch the controller off and on, then home"
_SENSOR = (
    "a heater's sensor reads wrong, so the controller halts: nothing is heated here, so connect "
    "the sensor (or 100 kOhm), or build Marlin without it (TEMP_SENSOR 0); then switch it off and "
    "on, and home"
)
_NEEDS = "this driver needs Marlin 2 with M113 (HOST_KEEPALIVE_FEATURE), M114, M118, M211 and M503"
_NO_SWITCH = (
    "check the switch, its wiring and the direction of homing; then switch the controller off and "
    "on, and home"
)
_TROUBLES = (
    ("kill() called", KILLED, _OFF_AND_ON),
    ("Printer halted", KILLED, _OFF_AND_ON),
    ("MINTEMP", FAILING, _SENSOR),
    ("MAXTEMP", FAILING, _SENSOR),
    ("Thermal Runaway", FAILING, "switch every heater off (M104 S0, M140 S0); " + _OFF_AND_ON),
    ("Heating failed", FAILING, "switch every heater off (M104 S0, M140 S0); " + _OFF_AND_ON),
    ("Heating Failed", FAILING, "switch every heater off (M104 S0, M140 S0); " + _OFF_AND_ON),
    ("system stopped", FAILING, _OFF_AND_ON),
    ("Homing Failed", FAILING, _NO_SWITCH),
    ("Homing failed", FAILING, _NO_SWITCH),
    ("Probing", FAILING, _NO_SWITCH),
    ("KILL caused", FAILING, _OFF_AND_ON),
    ("// ", KLIPPER, "this is Klipper's console"),
    ("!! ", KLIPPER, "this is Klipper's console"),
    ("stopped due to errors", "stopped by error", "clear its cause, then home again"),
    ("STOP called", "stopped by error", "clear its cause, then home again"),
    ("Unknown command", "unknown command", _NEEDS),
    ("First", "not homed", "home the stage first"),
    ("first", "not homed", "home the stage first"),
)


def alarm(device: str, text: str) -> StageAlarmError:
    """Return the error of a trouble: its code is one word for programs."""
    for part, code, advice in _TROUBLES:
        if part in text:
            return StageAlarmError(device, text.rstrip("."), advice=advice, code=code)
    advice = "see what the controller complains about, then home again"
    return StageAlarmError(device, text.rstrip("."), advice=advice, code="error")


def klipper(device: str, found: str) -> DeviceNotFoundError:
    """Return the error of a board that runs Klipper."""
    return DeviceNotFoundError(
        device,
        f"asked for Marlin, found Klipper ({found})",
        advice="Klipper's console does not tell when a move has ended: put Marlin 2 or grblHAL on "
        'the board, or drive Klipper by a program of your own (stage.kind = "command")',
    )
