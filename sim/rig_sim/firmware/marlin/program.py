"""The main loop of the simulated Marlin: lines from the queue, one after the other."""

import re
from collections.abc import Callable

from rig_sim.firmware.axes import AXES, Vector
from rig_sim.firmware.chip import Program
from rig_sim.firmware.marlin.homing import home
from rig_sim.firmware.marlin.machine import QUEUE_LINES, Machine
from rig_sim.firmware.marlin.settings import about, banner, position_line
from rig_sim.firmware.marlin.waiting import wait

_WORD = re.compile(r"([A-Z])(-?\d*\.?\d+)?", re.ASCII)
QUESTIONS = ("M114", "M115", "M211", "M503")
_PER_AXIS = {"M92": "steps", "M201": "acceleration", "M203": "rate_mm_s"}


def run(machine: Machine, boot_s: float) -> Program:
    """Boot, then serve lines until killed; only fresh power helps after that."""
    until_s = machine.now_s + boot_s
    while machine.now_s < until_s:
        machine.wake_s = until_s
        yield
    machine.wake_s = None
    machine.is_booting = False
    machine.print(*banner(), *machine.settings.lines(), *machine.settings.soft_stop_lines())
    while not machine.is_killed:
        machine.pull()
        if not machine.queue:
            yield
            continue
        text, number = machine.queue[0]
        printed = len(machine.printed)
        yield from _execute(machine, text)
        if not machine.is_killed:
            machine.queue.popleft()
            is_told = machine.config.marlin.advanced_ok and number is not None
            room = f"P{machine.steppers.free_blocks} B{QUEUE_LINES - len(machine.queue)}"
            late = _take_answer(machine, text, printed)
            machine.print(f"ok N{number} {room}" if is_told else "ok")
            machine.printed += late
    while True:
        yield


def _take_answer(machine: Machine, text: str, printed: int) -> bytes:
    """Take back the answer to a question, where the firmware gives it after its `ok`."""
    if not machine.config.marlin.answers_late or text.split(" ", maxsplit=1)[0] not in QUESTIONS:
        return b""
    late = bytes(machine.printed[printed:])
    del machine.printed[printed:]
    return late


def _execute(machine: Machine, text: str) -> Program:
    code, _, rest = text.strip().partition(" ")
    words = {letter: float(number or 0.0) for letter, number in _WORD.findall(rest)}
    if code in {"G0", "G1"}:
        yield from _move(machine, words)
    elif code == "G4":
        until_s = machine.now_s + words.get("P", 0.0) * 1e-3 + words.get("S", 0.0)
        yield from wait(machine, lambda: not machine.steppers.has_blocks)
        yield from wait(machine, lambda: machine.now_s >= until_s, until_s)
    elif code == "G28":
        yield from home(machine, [axis for axis in AXES if axis in words] or list(AXES))
    elif code == "M400":
        yield from _finish(machine)
    elif code in {"M112", "M410"}:
        machine.heed(code[1:])
    elif code == "M118":
        machine.print(rest)
    elif code in {"M18", "M84"}:
        yield from wait(machine, lambda: not machine.steppers.has_blocks)
        if "S" not in words:  # with S it sets when that is to happen
            machine.homed.clear()
    elif not _answer(machine, code) and not _set(machine, code, words):
        machine.print(f'echo:Unknown command: "{text}"')


def _finish(machine: Machine) -> Program:
    """Wait for the end of all motion."""
    if machine.lies:
        machine.lies -= 1
        return
    yield from wait(machine, lambda: not machine.steppers.has_blocks)


def _answer(machine: Machine, code: str) -> bool:
    """Print what is asked for; returns whether it was a question."""
    settings = machine.settings
    answers: dict[str, Callable[[], list[str]]] = {
        "M105": lambda: ["T:21.00 /0.00 B:21.00 /0.00 @:0 B@:0"],
        "M114": lambda: [position_line(machine.planned_mm, settings)],
        "M115": lambda: about(settings),
        "M119": lambda: ["Reporting endstop status", "x_min: open"],
        "M211": settings.soft_stop_lines,
        "M503": settings.lines,
    }
    if code not in answers:
        return False
    machine.print(*answers[code]())
    return True


def _set(machine: Machine, code: str, words: dict[str, float]) -> bool:
    """Take a setting; returns whether it was one."""
    settings = machine.settings
    if code in {"G90", "G91"}:
        machine.is_incremental = code == "G91"
    elif code in _PER_AXIS:
        values: dict[str, float] = getattr(settings, _PER_AXIS[code])
        values.update({axis: words[axis] for axis in AXES if axis in words})
    elif code == "M113":
        settings.keepalive_s = words.get("S", settings.keepalive_s)
    elif code == "M204":
        settings.travel_acceleration = words.get("T", settings.travel_acceleration)
    elif code == "M220":
        settings.feed_share = words.get("S", 100.0) / 100.0
    elif code not in {"G21", "M110", "M17", "M108", "M999"}:
        return False
    return True


def _move(machine: Machine, words: dict[str, float]) -> Program:
    """Queue a straight motion; beyond the soft end stops of a homed axis it is clamped."""
    settings = machine.settings
    if "F" in words:
        machine.feed_mm_s = words["F"] / 60.0
    target = list(machine.planned_mm)
    for index, axis in enumerate(AXES):
        if axis in words:
            target[index] = words[axis] + (target[index] if machine.is_incremental else 0.0)
            if settings.has_soft_stops and axis in machine.homed:
                low_mm, high_mm = settings.range_mm[axis]
                target[index] = min(max(target[index], low_mm), high_mm)
    yield from wait(machine, lambda: not machine.steppers.is_full)
    if machine.is_killed:
        return
    target_mm: Vector = (target[0], target[1], target[2])
    machine.planned_mm = target_mm
    machine.steppers.add(target_mm, machine.feed_mm_s * settings.feed_share)
    if machine.steppers.has_blocks and machine.steppers.end_s is None:
        machine.steppers.begin(machine.now_s)
