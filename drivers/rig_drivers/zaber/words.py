"""What the flags and refusals of a Zaber device mean, and what to do.

Source: Zaber ASCII protocol manual, sections on warning flags and rejected commands.
"""

from rig.errors import StageAlarmError

HARMLESS = frozenset({"WT", "WP", "ND", "NR", "NT", "NU", "NJ"})
"""Flags under which a position can be trusted: warm electronics, rounding, pending settings."""
UNHOMED = frozenset({"WR", "WH"})
"""Flags of an axis that has not found its reference."""
INTERFERENCE = frozenset({"NC", "NI"})
"""Flags of somebody else's hand on the axis; the position itself stays known."""

_FLAGS = {
    "FF": ("critical system error", "switch the supply off and on, and update the firmware"),
    "FN": ("the peripheral is not supported", "check which stage is plugged in"),
    "FZ": ("the peripheral was changed and is inactive", "activate it, then home"),
    "FH": ("the emergency stop is pressed, the motor has no current", "release it, then home"),
    "FV": ("the supply is too high or too low, the motor has no current", "check it, then home"),
    "FO": ("the motor was switched off", "home again"),
    "FC": ("too much current at switching on", "check the supply and the motor's cable"),
    "FM": ("the motor is too hot", "let it cool down, then home"),
    "FD": ("the motor driver switched itself off, by heat or supply", "check both, then home"),
    "FQ": ("encoder error, the position may be wrong", "check its cable, then home"),
    "FI": ("the encoder's index was missed", "home again"),
    "FA": ("the analogue encoder could not be read", "home again"),
    "FR": ("overdrive limit exceeded, the motor was overloaded", "lighten the load, then home"),
    "FS": ("stalled and stopped", "clear the way, then home"),
    "FB": ("a stream left its bounds", "end the program that streams, then home"),
    "FP": ("the path was not followed", "lower the speed, then home"),
    "FE": ("a limit sensor was not found or triggered out of place", "check it, then home"),
    "FT": ("too many turns in one direction", "move back by hand, then home"),
    "WL": ("a limit sensor triggered unexpectedly, steps may be lost", "clear the way, then home"),
    "WV": ("the supply is out of range", "check it, then home"),
    "WS": ("stalled and recovered, steps may be lost", "clear the way, then home"),
    "WM": ("pushed away at rest", "clear the way, then home"),
    "WR": ("no reference position, the supply was interrupted", "home the stage first"),
    "WH": ("not homed since the supply was switched on", "home the stage first"),
    "NC": ("the knob is being turned", "keep hands off and repeat"),
    "NI": (
        "the motion was interrupted by the knob or another program",
        "what was measured since the last move may be wrong: keep hands off and repeat it",
    ),
}

_REFUSALS = {
    "AGAIN": ("the device was not ready", "repeat"),
    "BADAXIS": ("no such axis", "correct axis_number"),
    "BADCOMMAND": ("unknown command", "if the line was damaged, check the cable"),
    "BADDATA": (
        "the value is out of range",
        "check limit.min, limit.max and the profile's travel_mm",
    ),
    "BADMESSAGEID": ("not a message id", "check the cable"),
    "DEVICEONLY": ("a command for the whole device was sent to an axis", "check the cable"),
    "DRIVERDISABLED": ("the motor has no current", "home again"),
    "FULL": ("the device's memory is full", "switch its supply off and on"),
    "INACTIVE": ("the axis is inactive", "activate its peripheral"),
    "LOCKSTEP": ("the axis is in a lockstep group", "disable the group"),
    "NOACCESS": ("the access level is too low", "lower system.access"),
    "NOTSUPPORTED": ("the stage does not support this", "update its firmware"),
    "PARKED": ("the axis is parked", "unpark it"),
    "STATUSBUSY": ("the axis moves", "wait for its end"),
}


def alarm(device: str, what: str, flag: str) -> StageAlarmError:
    """Return the error of a warning flag: what it means and what to do."""
    found, advice = _FLAGS.get(flag, ("unknown flag", "see the device manual, then home"))
    return StageAlarmError(device, f"{what}, found {flag}: {found}", advice=advice, code=flag)


def refusal(device: str, command: str, reason: str) -> StageAlarmError:
    """Return the error of a command that the device rejected."""
    found, advice = _REFUSALS.get(reason, ("unknown reason", "see the device manual"))
    return StageAlarmError(
        device, f"`{command}` was refused, RJ {reason}: {found}", advice=advice, code=reason
    )
