"""The G-code that the simulated GRBL understands, with GRBL's own error codes.

Words G0 G1 G4 G20 G21 G53 G54 G80 G90 G91 G92 G94, X Y Z F N P S T; everything else is
`error:20`. Arcs, probing, spindle and coolant have no place on a stage.
"""

from dataclasses import dataclass, replace

from rig_sim.firmware.axes import AXES, Vector
from rig_sim.firmware.grbl.settings import NUMBER

EXPECTED_LETTER = 1
BAD_NUMBER = 2
NEGATIVE_VALUE = 4
INVALID_JOG = 16
UNSUPPORTED = 20
MODAL_VIOLATION = 21
NO_FEED = 22
NOT_INTEGER = 23
AXIS_CONFLICT = 24
REPEATED_WORD = 25
NO_AXIS_WORDS = 26
MISSING_VALUE = 28
G53_NEEDS_G0_G1 = 30
AXIS_WORDS_UNUSED = 31
UNUSED_WORDS = 36

MM_PER_INCH = 25.4

_GROUPS = {
    4: "non-modal", 53: "non-modal", 92: "non-modal",
    0: "motion", 1: "motion", 80: "motion",
    90: "distance", 91: "distance", 94: "feed mode", 20: "units", 21: "units", 54: "coordinates",
}  # fmt: skip


class GcodeError(Exception):
    """A line that GRBL refuses; carries the number after `error:`."""

    def __init__(self, code: int) -> None:
        super().__init__(f"error:{code}")
        self.code = code


@dataclass(frozen=True, slots=True)
class Modes:
    """What one line leaves behind for the next."""

    motion: int = 0
    inches: bool = False
    incremental: bool = False
    feed_mm_min: float = 0.0
    offset_mm: Vector = (0.0, 0.0, 0.0)
    """G92 offset: machine minus work coordinates."""


@dataclass(frozen=True, slots=True)
class Block:
    """What one line wants done."""

    target_mm: Vector | None = None
    """Machine coordinates to move to."""
    feed_mm_s: float | None = None
    """None: as fast as the axes can."""
    dwell_s: float | None = None


def parse_block(
    line: str, modes: Modes, position_mm: Vector, *, is_jog: bool = False
) -> tuple[Block, Modes]:
    """Read one line of G-code.

    Args:
        line: upper case without spaces and comments; for a jog what follows `$J=`.
        modes: left by the lines before.
        position_mm: machine coordinates at which the last queued motion ends.
        is_jog: whether jog rules hold: G1 implied, own feed rate, modes untouched.

    Raises:
        GcodeError: GRBL would refuse the line.
    """
    commands, values = _words(line)
    axis_words = {letter: values[letter] for letter in AXES if letter in values}
    motion = 1 if is_jog else commands.get("motion", modes.motion)
    non_modal = commands.get("non-modal")
    if non_modal == 92 and "motion" in commands:
        raise GcodeError(AXIS_CONFLICT)
    if is_jog and (set(commands) - {"non-modal", "distance", "units"} or non_modal in {4, 92}):
        raise GcodeError(INVALID_JOG)
    inches = commands["units"] == 20 if "units" in commands else modes.inches
    incremental = commands["distance"] == 91 if "distance" in commands else modes.incremental
    unit_mm = MM_PER_INCH if inches else 1.0
    if is_jog and "F" not in values:
        raise GcodeError(NO_FEED)
    feed_mm_min = values["F"] * unit_mm if "F" in values else modes.feed_mm_min
    left = replace(
        modes, motion=motion, inches=inches, incremental=incremental, feed_mm_min=feed_mm_min
    )
    axes_mm = {axis: value * unit_mm for axis, value in axis_words.items()}
    dwell_s = _dwell_s(non_modal, values)
    if non_modal == 92:
        if not axes_mm:
            raise GcodeError(NO_AXIS_WORDS)
        offset = tuple(
            position_mm[i] - axes_mm[a] if a in axes_mm else modes.offset_mm[i]
            for i, a in enumerate(AXES)
        )
        return Block(), replace(left, offset_mm=(offset[0], offset[1], offset[2]))
    _check_motion(motion, non_modal, has_axes=bool(axes_mm), feed_mm_min=feed_mm_min, is_jog=is_jog)
    if not axes_mm:
        return Block(dwell_s=dwell_s), left
    target_mm = _target_mm(axes_mm, modes, position_mm, non_modal == 53, incremental)
    feed_mm_s = None if motion == 0 else feed_mm_min / 60.0
    return Block(target_mm, feed_mm_s, dwell_s), modes if is_jog else left


def _words(line: str) -> tuple[dict[str, int], dict[str, float]]:
    """Split a line into commands by modal group and values by letter."""
    commands: dict[str, int] = {}
    values: dict[str, float] = {}
    at = 0
    while at < len(line):
        letter = line[at]
        if not "A" <= letter <= "Z":
            raise GcodeError(EXPECTED_LETTER)
        number = NUMBER.match(line, at + 1)
        if number is None:
            raise GcodeError(BAD_NUMBER)
        at = number.end()
        value = float(number[0])
        if letter == "G":
            _take_command(value, commands)
        elif letter not in "XYZFNPST":
            raise GcodeError(UNSUPPORTED)
        elif letter in values:
            raise GcodeError(REPEATED_WORD)
        elif letter in "FNPST" and value < 0.0:
            raise GcodeError(NEGATIVE_VALUE)
        else:
            values[letter] = value
    return commands, values


def _take_command(value: float, commands: dict[str, int]) -> None:
    group = _GROUPS.get(int(value))
    if group is None:
        raise GcodeError(UNSUPPORTED)
    if value != int(value):
        raise GcodeError(NOT_INTEGER)
    if group in commands:
        raise GcodeError(MODAL_VIOLATION)
    commands[group] = int(value)


def _dwell_s(non_modal: int | None, values: dict[str, float]) -> float | None:
    if non_modal != 4:
        if "P" in values:
            raise GcodeError(UNUSED_WORDS)
        return None
    if "P" not in values:
        raise GcodeError(MISSING_VALUE)
    return values["P"]


def _check_motion(
    motion: int, non_modal: int | None, *, has_axes: bool, feed_mm_min: float, is_jog: bool
) -> None:
    if motion == 80:
        if non_modal == 53:
            raise GcodeError(G53_NEEDS_G0_G1)
        if has_axes:
            raise GcodeError(AXIS_WORDS_UNUSED)
    if is_jog and not has_axes:
        raise GcodeError(NO_AXIS_WORDS)
    if motion == 1 and has_axes and feed_mm_min == 0.0:
        raise GcodeError(NO_FEED)


def _target_mm(
    axes_mm: dict[str, float],
    modes: Modes,
    position_mm: Vector,
    in_machine: bool,
    incremental: bool,
) -> Vector:
    target = list(position_mm)
    for index, axis in enumerate(AXES):
        if axis not in axes_mm:
            continue
        value_mm = axes_mm[axis]
        if in_machine:
            target[index] = value_mm
        elif incremental:
            target[index] += value_mm
        else:
            target[index] = value_mm + modes.offset_mm[index]
    return target[0], target[1], target[2]
