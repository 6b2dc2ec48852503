"""By which command a descendant of GRBL finds the reference switch, and how long that takes.

Source: GRBL v1.1 `config.h` (homing cycles, single-axis homing) and `limits.c`; the letters of
`[OPT:...]` of GRBL and grblHAL; what grblHAL's `go_home` refuses; FluidNC's list of commands, and
the phases of its homing.
"""

from collections.abc import Mapping

from rig.errors import StageAlarmError
from rig_drivers.grbl.dialect import Dialect

EVERY_AXIS = "$H"
NOT_ALONE = ("error:3", "error:5")
"""What is said to `$HX` where one axis cannot be homed alone: unknown, or (grblHAL without bit 1
of $22) switched off."""
FAILED_HOMING = ("ALARM:8", "ALARM:9")
SEARCH, LOCATE, PAUSE, PULL_OFF = 25, 24, 26, 27
"""Settings: speeds in mm per minute, ms between the parts, mm."""


def homing_commands(dialect: Dialect, options: str, axis: str) -> tuple[str, ...]:
    """Return what to send, each one only where the one before is unknown.

    A stage has one switch. `$H` homes every axis, in stock GRBL the absent Z first; `$HX` homes one
    and is known to FluidNC, to whatever tells the option `H`, and to a grblHAL set to it.

    Args:
        dialect: from the banner.
        options: the letters of `[OPT:...]`.
        axis: of the profile.
    """
    single = EVERY_AXIS + axis
    if dialect is Dialect.FLUIDNC or "H" in options:
        return (single,)
    return (single, EVERY_AXIS) if dialect is Dialect.GRBLHAL else (EVERY_AXIS,)


def homed_every_axis(error: StageAlarmError, axis: str) -> StageAlarmError:
    """Return the error of a homing of all axes that one switch cannot end."""
    return StageAlarmError(
        error.device,
        f"{error.symptom}; $H homes every axis, stock GRBL begins with Z",
        advice=f"if only {axis} has a switch, build the firmware with HOMING_CYCLE_0 "
        f"(1<<{axis}_AXIS) and no other cycle, or with HOMING_SINGLE_AXIS_COMMANDS (grblHAL: set "
        f"bit 1 of $22), so that {axis} homes alone; else {error.advice}",
        code=error.code,
    )


def homing_time_s(settings: Mapping[int, float], travel_mm: float) -> float | None:
    """Return how long homing takes from the far end; None where the settings do not tell.

    It searches over the travel, backs off, looks again slowly over the same way, backs off again,
    and pauses after each part.
    """
    try:
        search_mm_s, locate_mm_s = settings[SEARCH] / 60.0, settings[LOCATE] / 60.0
        pauses_s = 4.0 * settings[PAUSE] * 1e-3
        back_mm = settings[PULL_OFF]
        return (travel_mm + 2.0 * back_mm) / search_mm_s + back_mm / locate_mm_s + pauses_s
    except (KeyError, ZeroDivisionError):
        return None


FLUIDNC_HOMING_KEYS = (
    "homing/seek_mm_per_min",
    "homing/feed_mm_per_min",
    "homing/settle_ms",
    "motor0/pulloff_mm",
)
"""What tells how long FluidNC homes, below `/axes/x/`."""


def fluidnc_homing_time_s(values: Mapping[str, str], travel_mm: float) -> float | None:
    """Return the same for FluidNC, which backs off as slowly as it looks again.

    Args:
        values: the answers by key of `FLUIDNC_HOMING_KEYS`.
        travel_mm: of the axis.
    """
    try:
        seek, feed, settle, back_mm = (float(values[key]) for key in FLUIDNC_HOMING_KEYS)
        slow_s = 3.0 * back_mm / (feed / 60.0)
        return travel_mm / (seek / 60.0) + slow_s + 4.0 * settle * 1e-3
    except (KeyError, ValueError, ZeroDivisionError):
        return None
