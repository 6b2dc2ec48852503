"""What GRBL 1.1 and its descendants say, as values: pure functions from one line of text.

Source: GRBL v1.1 interface documentation; the tables of error and alarm codes of GRBL, grblHAL and
FluidNC, which agree up to ALARM:9.
"""

import re
from dataclasses import dataclass
from enum import Enum

from rig.errors import StageAlarmError
from rig_drivers.stage.dialogue import Noise

AXES = "XYZ"


class Dialect(Enum):
    """Which firmware it is."""

    GRBL = "grbl"
    GRBLHAL = "grblHAL"
    FLUIDNC = "FluidNC"


@dataclass(frozen=True, slots=True)
class Ok:
    """A line was taken; a motion is queued, not done."""


@dataclass(frozen=True, slots=True)
class Refused:
    """`error:N`: a line was not taken."""

    code: int


@dataclass(frozen=True, slots=True)
class Alarm:
    """`ALARM:N`: everything has stopped."""

    code: int


@dataclass(frozen=True, slots=True)
class Banner:
    """The controller has just started or been reset."""

    version: str
    dialect: Dialect = Dialect.GRBL

    @property
    def number(self) -> tuple[int, int]:
        """Major and minor version."""
        major, minor = re.findall(r"\d+", self.version)[:2]
        return int(major), int(minor)


@dataclass(frozen=True, slots=True)
class Setting:
    """One line of `$$`."""

    number: int
    value: float


@dataclass(frozen=True, slots=True)
class Message:
    """`[KIND:text]`, such as build information, or `$NAME=text`, a setting that is no number."""

    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class Status:
    """A status report; positions in mm for the axes X, Y, Z."""

    state: str
    """Idle, Run, Jog, Hold:0, Hold:1, Home, Alarm, Alarm:11, ..."""
    machine_mm: tuple[float, ...] | None
    work_mm: tuple[float, ...] | None
    """Given instead of machine coordinates where $10 says so."""
    offset_mm: tuple[float, ...] | None
    """Machine minus work coordinates; comes only now and then."""


Reply = Ok | Refused | Alarm | Banner | Setting | Message | Status | Noise

_REFUSED = re.compile(r"error:(\d{1,3})", re.ASCII)
_ALARM = re.compile(r"ALARM:(\d{1,3})", re.ASCII)
_BANNER = re.compile(r"(Grbl\w*) (\d{1,3}\.\d{1,3}\w*) \[(FluidNC)?.*\]", re.ASCII)
_SETTING = re.compile(r"\$(\d{1,3})=(-?\d{1,9}(?:\.\d{1,6})?)(?: \(.*\))?", re.ASCII)
_TEXT_SETTING = re.compile(r"\$(\d{1,3}|/[a-z0-9_/]{1,60})=(.*)", re.ASCII)
_MESSAGE = re.compile(r"\[([A-Za-z0-9][A-Za-z0-9 ]{0,19}):(.*)\]", re.ASCII)
"""grblHAL has kinds of two and three words, such as `NVS STORAGE`."""
_STATUS = re.compile(r"<([A-Z][a-z]+(?::\d{1,2})?)((?:\|[ -;=?-{}~]+)*)>", re.ASCII)
"""Any field of printable characters: every descendant of GRBL adds keys of its own."""
_POSITION = re.compile(r"-?\d{1,6}\.\d{3}", re.ASCII)


def parse_reply(line: str) -> Reply:
    """Return what a line means; anything that is not GRBL is `Noise`, never an exception."""
    if line == "ok":
        return Ok()
    if found := _REFUSED.fullmatch(line):
        return Refused(int(found[1]))
    if found := _ALARM.fullmatch(line):
        return Alarm(int(found[1]))
    if found := _BANNER.fullmatch(line):
        return Banner(found[2], _dialect(found[1], found[3]))
    if found := _SETTING.fullmatch(line):
        return Setting(int(found[1]), float(found[2]))
    if (found := _TEXT_SETTING.fullmatch(line)) and "\ufffd" not in line:
        return Message(found[1], found[2])
    if found := _MESSAGE.fullmatch(line):
        return Message(found[1], found[2])
    if found := _STATUS.fullmatch(line):
        return _status(found[1], found[2]) or Noise(line)
    return Noise(line)


def _dialect(name: str, fork: str | None) -> Dialect:
    if fork is not None:
        return Dialect.FLUIDNC
    return Dialect.GRBLHAL if name.lower() == "grblhal" else Dialect.GRBL


def _status(state: str, fields: str) -> Status | None:
    """Read the fields by key, in any order; None if a position is damaged or none is there."""
    vectors: dict[str, tuple[float, ...]] = {}
    for field in fields.split("|")[1:]:
        key, _, text = field.partition(":")
        if key in {"MPos", "WPos", "WCO"}:
            values = text.split(",")
            if key in vectors or len(values) < len(AXES):
                return None
            if not all(_POSITION.fullmatch(value) for value in values):
                return None
            vectors[key] = tuple(float(value) for value in values)
    if ("MPos" in vectors) == ("WPos" in vectors):
        return None
    return Status(state, vectors.get("MPos"), vectors.get("WPos"), vectors.get("WCO"))


STANDSTILLS = {
    "Door:0": ("the safety door was open and is closed again", "home again"),
    "Door:1": ("the safety door is open", "close it (or bridge its input), then home again"),
    "Hold:0": ("a feed hold", "see who has sent it, then home again"),
    "Tool": ("the controller waits for a change of tool", "end that (`~`), then home again"),
    "Sleep": ("the motors have no current", "home again, which wakes the controller up"),
    "Check": ("the controller only checks G-code ($C) and moves nothing", "send $C, then home"),
    "Alarm:11": (
        "the controller wants every axis to be homed before any may move",
        "take the other axes out of its homing ($44, $45, ...) or bit 2 out of $22, then home",
    ),
}
"""States in which nothing moves although nothing has ended: what each means, and what to do."""


def standstill(device: str, what: str, state: str) -> StageAlarmError:
    """Return the error of a controller that stands, but not because it has arrived."""
    found, advice = STANDSTILLS.get(state, ("", "see what stopped it, then home again"))
    told = f"state {state}: {found}" if found else f"state {state}"
    return StageAlarmError(
        device, f"{what}, found the controller in {told}", advice=advice, code=state
    )


_ALARMS = {
    1: ("a limit switch was hit", "clear the way, then home"),
    2: (
        "the move would have left the controller's soft limits",
        "home, and check $130 and the travel",
    ),
    3: ("reset while in motion, the position is lost", "home again"),
    4: ("probe in the wrong state", "no probe is used here, check the wiring"),
    5: ("probe found nothing", "no probe is used here, check the wiring"),
    6: ("homing was interrupted by a reset", "home again"),
    7: ("the safety door was opened during homing", "close it and home again"),
    8: ("the limit switch did not open again after pull-off", "raise $27 or check the switch"),
    9: ("no limit switch was found", "check the switch, its wiring and the homing direction ($23)"),
}

_MORE_ALARMS = {
    Dialect.GRBL: {},
    Dialect.GRBLHAL: {
        10: ("the emergency stop is pressed", "release it, then home"),
        11: ("homing is required", "home the stage"),
        12: ("a limit switch is closed", "clear the way, then home"),
        13: ("probe protection", "no probe is used here, check the wiring"),
        14: ("the spindle did not reach its speed", "no spindle is used here, switch it off"),
        15: ("the second motor of the axis found no switch", "check it, then home"),
        16: ("the self-test failed", "switch the controller off and on"),
        17: ("the motor driver reports a fault", "check motor and driver, then home"),
        18: ("homing is not configured", "set $22 and the axis of $44"),
        19: ("Modbus does not answer", "check the spindle's cable or switch it off"),
        20: ("the expander does not answer", "check its cable"),
        21: ("the settings memory failed", "restore the settings"),
    },
    Dialect.FLUIDNC: {
        10: ("the spindle does not answer", "remove it from the configuration"),
        11: ("a control or limit pin was active at the start", "release it, then home"),
        12: ("both limit switches are closed", "check their wiring"),
        13: ("hard stop", "clear the way, then home"),
        14: ("not homed", "home the stage"),
        15: ("the controller has just started", "home the stage"),
        16: ("the expander was reset", "home again"),
        17: ("a line of G-code was wrong", "check the cable"),
        18: ("the probe hit", "no probe is used here, check the wiring"),
    },
}  # fmt: skip

_DAMAGED = "if the line was damaged, check the cable"
_REFUSALS = {
    1: ("a word did not begin with a letter", _DAMAGED),
    2: ("a number could not be read", _DAMAGED),
    3: ("unknown $ command", _DAMAGED),
    5: ("homing is off", "set $22=1"),
    8: ("the controller is not idle", "home first"),
    9: ("the controller is locked by an alarm", "home first"),
    10: ("soft limits need homing", "set $22=1"),
    11: ("the line was too long", _DAMAGED),
    13: ("the safety door is open", "close it"),
    15: ("the target is outside the controller's travel", "check $130 and the profile's travel_mm"),
    16: ("not a valid jog", _DAMAGED),
    20: ("an unknown G-code word", _DAMAGED),
    22: ("no feed rate", _DAMAGED),
    33: ("not a valid target", _DAMAGED),
}

_MORE_REFUSALS = {
    Dialect.GRBL: {},
    Dialect.GRBLHAL: {
        18: ("the reset input is active", "release it, then home"),
        45: ("a limit switch is closed", "clear the way, then home"),
        46: ("homing is required", "home the stage"),
        49: ("the self-test failed", "switch the controller off and on"),
        50: ("the emergency stop is pressed", "release it, then home"),
        51: ("the motor driver reports a fault", "check motor and driver, then home"),
        55: ("homing is not configured", "set $22 and the axis of $44"),
        79: ("an emergency has stopped everything", "mend its cause, then home"),
    },
    Dialect.FLUIDNC: {
        5: ("no axis homes", "give the axis homing with a cycle in its configuration file"),
        18: ("no axis has a homing cycle", "set homing/cycle in its configuration file"),
        19: (
            "this axis may not be homed alone",
            "set homing/allow_single_axis to true in its configuration file",
        ),
        40: ("a control or limit pin is active", "release it, then home"),
        130: ("the jog was cancelled", "home again"),
        152: ("FluidNC's configuration is invalid", "see its boot messages ($SS)"),
        162: ("FluidNC takes this setting from its configuration file only", "set it there"),
    },
}  # fmt: skip


def alarm(device: str, code: int, dialect: Dialect = Dialect.GRBL) -> StageAlarmError:
    """Return the error of an alarm: what it means and what to do."""
    alarms = _ALARMS | _MORE_ALARMS[dialect]
    found, advice = alarms.get(code, ("unknown alarm", "reset and home again"))
    name = f"ALARM:{code}"
    return StageAlarmError(device, f"{name}: {found}", advice=advice, code=name)


def refusal(device: str, line: str, code: int, dialect: Dialect = Dialect.GRBL) -> StageAlarmError:
    """Return the error of a line that the controller refused."""
    refusals = _REFUSALS | _MORE_REFUSALS[dialect]
    unknown = ("unknown error", f"see the documentation of {dialect.value}")
    found, advice = refusals.get(code, unknown)
    name = f"error:{code}"
    return StageAlarmError(device, f"{line} was refused, {name}: {found}", advice=advice, code=name)
