"""The main loop of the simulated GRBL: lines in, answers out."""

from collections.abc import Generator, Sequence

from rig_sim.firmware.axes import AXES
from rig_sim.firmware.chip import Program
from rig_sim.firmware.grbl.gcode import Block, GcodeError, parse_block
from rig_sim.firmware.grbl.homing import find_no_switch, home
from rig_sim.firmware.grbl.machine import SOFT_LIMIT, Machine
from rig_sim.firmware.grbl.realtime import auto_start, realtime
from rig_sim.firmware.grbl.report import (
    BANNERS,
    BUILD_INFO,
    HELP,
    State,
    modes_line,
    parameter_lines,
)
from rig_sim.firmware.grbl.settings import INVALID_STATEMENT, SETTING_DISABLED

OK = 0
NOT_IDLE = 8
LOCKED = 9
LINE_TOO_LONG = 11
TRAVEL_EXCEEDED = 15

CONNECTING_EVERY_S = 2.0
LINE_CHARACTERS = 79
LINE_MEMORY = 1000
"""Blanks and comments do not count, but nobody sends so many."""

Answer = Generator[None, None, int]
"""A command at work; it ends with the error code, 0 for `ok`."""


def run(machine: Machine, boot_s: float) -> Program:
    """Boot, then serve lines for ever, from reset to reset."""
    yield from machine.sleep(boot_s)
    machine.is_booting = False
    yield from _connect(machine)
    while True:
        machine.clear()
        machine.printed += BANNERS[machine.settings.dialect].encode()
        yield from _serve(machine)


def _connect(machine: Machine) -> Program:
    """Look for the network, as FluidNC with WiFi does, and say so."""
    until_s = machine.now_s + machine.settings.connecting_s
    while machine.now_s < until_s:
        machine.print("[MSG:INFO: Connecting.]")
        yield from machine.sleep(CONNECTING_EVERY_S)


def _serve(machine: Machine) -> Program:
    """Read and execute lines until the next reset."""
    if machine.state in {State.ALARM, State.SLEEP}:
        machine.print("[MSG:'$H'|'$X' to unlock]")
        machine.state = State.ALARM
    else:
        machine.state = State.IDLE
    line = ""
    while not machine.is_aborted:
        if not machine.received:
            auto_start(machine)
            yield from realtime(machine)
            if not machine.is_aborted:
                yield
            continue
        character = chr(machine.received.popleft())
        if character not in "\r\n":
            line += character if len(line) < LINE_MEMORY else ""
            continue
        yield from realtime(machine)
        if not machine.is_aborted:
            code = yield from _execute(machine, line)
            machine.print("ok" if code == OK else f"error:{code}")
            line = ""
        if machine.is_asleep:
            yield from _sleep(machine)


def _sleep(machine: Machine) -> Program:
    """Stay without current until a reset; only reports are given."""
    machine.print("[MSG:Sleeping]")
    while not machine.is_aborted:
        yield
        yield from realtime(machine)


def _execute(machine: Machine, line: str) -> Answer:
    if machine.settings.dialect == "fluidnc" and line.startswith("$/"):
        return _tell_tree(machine, line[1:].strip())
    text = _without_comments(line)
    if len(text) > LINE_CHARACTERS:
        return LINE_TOO_LONG
    if not text:
        return OK
    if text.startswith("$J"):
        return (yield from _jog(machine, text))
    if text == "$H" or (text == f"$H{AXES[machine.axis]}" and machine.settings.dialect != "grbl"):
        return (yield from _home(machine, every_axis=text == "$H"))
    if text[0] == "$":
        return _system_command(machine, text)
    if machine.state in {State.ALARM, State.JOG}:
        return LOCKED
    return (yield from _gcode(machine, text))


def _tell_tree(machine: Machine, path: str) -> int:
    """Answer a question for a value of FluidNC's configuration."""
    lines = machine.settings.tree_lines(path)
    machine.print(*lines)
    return OK if lines else INVALID_STATEMENT


def _system_command(machine: Machine, text: str) -> int:
    """Execute what needs no waiting."""
    is_ready = machine.state in {State.IDLE, State.ALARM}
    if text in {"$", "$G"} or (text == "$$" and machine.state is State.JOG):
        machine.print(*_lines_about(machine, text))
    elif text == "$X":
        if machine.state is State.ALARM:
            machine.print("[MSG:Caution: Unlocked]")
            machine.state = State.IDLE
    elif not is_ready:
        return NOT_IDLE
    elif text == "$SLP":
        machine.state = State.SLEEP
    elif lines := _lines_about(machine, text):
        machine.print(*lines)
    else:
        machine.reports.refresh_offset()
        return machine.settings.store(text[1:])
    return OK


def _lines_about(machine: Machine, text: str) -> Sequence[str]:
    """Return the answer to a question, nothing if it is none."""
    match text:
        case "$":
            return (HELP,)
        case "$$":
            return machine.settings.lines()
        case "$G":
            return (modes_line(machine.modes),)
        case "$I":
            return BUILD_INFO[machine.settings.dialect]
        case "$#":
            return parameter_lines(machine.modes.offset_mm)
        case "$N":
            return ("$N0=", "$N1=")
        case _:
            return ()


def _home(machine: Machine, *, every_axis: bool) -> Answer:
    if machine.state not in {State.IDLE, State.ALARM}:
        return NOT_IDLE
    single = machine.settings.homes_single_axis
    if not machine.settings.homing or not (every_axis or single):
        return SETTING_DISABLED  # to grblHAL without bit 1 of $22 one axis alone is that too
    if every_axis and machine.settings.homes_z_first:
        yield from find_no_switch(machine)
    else:
        yield from home(machine)
    return OK


def _gcode(machine: Machine, text: str) -> Answer:
    try:
        block, modes = parse_block(text, machine.modes, machine.steppers.planned_mm)
    except GcodeError as error:
        return error.code
    if modes.offset_mm != machine.modes.offset_mm:
        machine.reports.refresh_offset()
    machine.modes = modes
    if block.dwell_s is not None:
        yield from _dwell(machine, block.dwell_s)
    if _is_beyond(machine, block):
        yield from _exceed_soft_limit(machine)
    else:
        yield from _queue(machine, block)
    return OK


def _jog(machine: Machine, text: str) -> Answer:
    """Queue a jog; unlike a G1, it is refused beyond the soft limits without an alarm."""
    if machine.state not in {State.IDLE, State.JOG}:
        return NOT_IDLE
    if not text.startswith("$J="):
        return INVALID_STATEMENT
    try:
        block, _ = parse_block(text[3:], machine.modes, machine.steppers.planned_mm, is_jog=True)
    except GcodeError as error:
        return error.code
    if _is_beyond(machine, block):
        return TRAVEL_EXCEEDED
    yield from _queue(machine, block)
    if machine.state is State.IDLE and machine.steppers.has_blocks:
        machine.state = State.JOG
        machine.steppers.begin(machine.now_s)
    return OK


def _is_beyond(machine: Machine, block: Block) -> bool:
    target_mm, settings = block.target_mm, machine.settings
    return target_mm is not None and settings.soft_limits and settings.exceeds_travel(target_mm)


def _queue(machine: Machine, block: Block) -> Program:
    """Give a block to the planner; waits while it is full."""
    if block.target_mm is None:
        return
    yield from realtime(machine)
    while machine.steppers.is_full and not machine.is_aborted:
        auto_start(machine)
        yield from realtime(machine)
        if machine.steppers.is_full and not machine.is_aborted:
            yield
    if not machine.is_aborted:
        machine.steppers.add(block.target_mm, block.feed_mm_s)


def _dwell(machine: Machine, duration_s: float) -> Program:
    """Wait for the end of all motion, then so long."""
    auto_start(machine)
    yield from realtime(machine)
    while (machine.steppers.has_blocks or machine.state is State.CYCLE) and not machine.is_aborted:
        yield
        yield from realtime(machine)
    until_s = machine.now_s + duration_s
    while machine.now_s < until_s and not machine.is_aborted:
        machine.wake_s = until_s
        yield
        yield from realtime(machine)
    machine.wake_s = None


def _exceed_soft_limit(machine: Machine) -> Program:
    """Come to rest, so that the position is kept, then lock up until a reset."""
    if machine.state is State.CYCLE:
        machine.flags.hold = machine.is_over_limit = True
        yield from realtime(machine)
        while machine.steppers.end_s is not None and not machine.is_aborted:
            yield
            yield from realtime(machine)
        if machine.is_aborted:
            return
    machine.reset()
    machine.flags.alarm = SOFT_LIMIT
    yield from realtime(machine)


def _without_comments(line: str) -> str:
    """Drop blanks, control characters, `/`, `( )` and `;` comments; raise to upper case."""
    kept = ""
    is_comment = False
    for character in line:
        if character == ";" and not is_comment:
            break
        if character in "()":
            is_comment = character == "("
        elif not is_comment and character > " " and character != "/":
            kept += character.upper()
    return kept
