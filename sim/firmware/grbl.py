"""A simulated GRBL 1.1h controller, byte by byte.

The firmware of a real one is a single program that blocks: on a full planner, on a dwell, on
homing. Here that program is a generator that yields wherever the real one would wait, and the
clock lets it go on; interrupts (received bytes, the end of a motion, the switch) set flags that
it looks at, as on the chip. What it says and when follows GRBL 1.1h; it leaves out arcs, probing,
spindle, coolant, overrides, check mode, sleep and the safety door.
"""

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass

from rig.devices import Clock
from rig.profile import FirmwareConfig
from sim.carriage import Carriage
from sim.firmware.grbl_gcode import BAD_NUMBER, Block, GcodeError, Modes, parse_block
from sim.firmware.grbl_report import (
    BANNER,
    BUILD_INFO,
    HELP,
    Snapshot,
    State,
    StatusReports,
    modes_line,
)
from sim.firmware.grbl_settings import (
    AXES,
    INVALID_STATEMENT,
    SETTING_DISABLED,
    GrblSettings,
)
from sim.firmware.grbl_steppers import Steppers

OK = 0
NOT_IDLE = 8
LOCKED = 9
LINE_TOO_LONG = 11
TRAVEL_EXCEEDED = 15

LINE_CHARACTERS = 79
LINE_MEMORY = 1000
RECEIVE_BYTES = 128
ALARM_PAUSE_S = 0.5

HARD_LIMIT = 1
SOFT_LIMIT = 2
ABORT_CYCLE = 3
HOMING_RESET = 6
HOMING_PULL_OFF = 8
HOMING_NO_SWITCH = 9

Program = Generator[None, None, None]
Answer = Generator[None, None, int]


@dataclass(slots=True)
class _Flags:
    """What interrupts leave for the program."""

    reset: bool = False
    status: bool = False
    start: bool = False
    hold: bool = False
    cancel: bool = False
    motion_ended: bool = False
    alarm: int = 0


class GrblFirmware:
    """The controller of the simulated stage; keeps `sim.wire.Firmware`."""

    def __init__(self, config: FirmwareConfig, carriage: Carriage, clock: Clock) -> None:
        self._config = config
        self._clock = clock
        self._settings = GrblSettings.of(config)
        self._steppers = Steppers(self._settings, carriage, AXES.index(config.axis))
        self._out = bytearray()
        self._power_up()

    @property
    def clock(self) -> Clock:
        """The clock on which it lives."""
        return self._clock

    def receive(self, data: bytes) -> None:
        """Take bytes from the wire."""
        self._advance()
        for byte in data:
            if not self._is_booting:
                self._interrupt(byte)
                self._resume()

    def transmit(self) -> bytes:
        """Hand over what has been printed since the last call."""
        self._advance()
        data = bytes(self._out)
        self._out.clear()
        return data

    def next_event_s(self) -> float | None:
        """Return when something will happen by itself; None if nothing will."""
        self._advance()
        return self._next_s()

    def hard_reset(self) -> None:
        """Start again, as when the port is opened (DTR) or the supply breaks down."""
        self._advance()
        self._steppers.kill(self._now_s, slips=True)
        self._steppers.forget()
        self._out.clear()
        self._power_up()

    # -- time ---------------------------------------------------------------------------------

    def _power_up(self) -> None:
        self._now_s = self._clock.now_s()
        self._wake_s: float | None = None
        self._is_booting = True
        self._state = State.ALARM if self._settings.homing else State.IDLE
        self._init()
        self._program = self._main()

    def _advance(self) -> None:
        """Let everything happen that was due until now, in order."""
        now_s = self._clock.now_s()
        self._resume()
        while (event_s := self._next_s()) is not None and event_s <= now_s:
            self._now_s = event_s
            if self._wake_s is not None and self._wake_s <= event_s:
                self._wake_s = None
            self._steppers_interrupt()
            self._resume()
        self._now_s = max(self._now_s, now_s)

    def _next_s(self) -> float | None:
        switch_s = self._steppers.switch_s if self._watches_switch else None
        times_s = (self._wake_s, self._steppers.end_s, switch_s)
        return min((t for t in times_s if t is not None), default=None)

    def _resume(self) -> None:
        next(self._program)

    def _sleep(self, duration_s: float) -> Program:
        """Do nothing at all, not even look at flags."""
        until_s = self._now_s + duration_s
        while self._now_s < until_s:
            self._wake_s = until_s
            yield

    # -- interrupts ---------------------------------------------------------------------------

    def _interrupt(self, byte: int) -> None:
        """Take one received byte: realtime commands never enter the line."""
        if byte == 0x18:
            self._mc_reset()
        elif byte == ord("?"):
            self._flags.status = True
        elif byte == ord("~"):
            self._flags.start = True
        elif byte == ord("!"):
            self._flags.hold = True
        elif byte == 0x85:
            self._flags.cancel = self._flags.cancel or self._state is State.JOG
        elif byte < 0x80 and len(self._received) < RECEIVE_BYTES:
            self._received.append(byte)

    @property
    def _watches_switch(self) -> bool:
        if self._state is State.HOMING:
            return self._is_approaching
        return self._settings.hard_limits and self._state is not State.ALARM

    def _steppers_interrupt(self) -> None:
        """The switch has closed, or a motion has ended."""
        steppers = self._steppers
        if self._watches_switch and _is_due(steppers.switch_s, self._now_s):
            if self._state is State.HOMING:
                steppers.kill(self._now_s, slips=False)
                self._switch_found = True
            else:
                self._mc_reset()
                self._flags.alarm = HARD_LIMIT
        elif _is_due(steppers.end_s, self._now_s):
            steppers.finish(self._now_s)
            is_running = self._state in {State.CYCLE, State.JOG} and not self._is_stopping
            if is_running and steppers.has_blocks:
                steppers.begin(self._now_s)
            else:
                self._flags.motion_ended = True

    def _mc_reset(self) -> None:
        """Ask for a reset; in motion this kills the steppers, and the position is lost."""
        if self._flags.reset:
            return
        self._flags.reset = True
        is_homing = self._state is State.HOMING
        if is_homing or self._steppers.end_s is not None:
            self._flags.alarm = self._flags.alarm or (HOMING_RESET if is_homing else ABORT_CYCLE)
            self._steppers.kill(self._now_s, slips=True)

    # -- the program --------------------------------------------------------------------------

    def _init(self) -> None:
        """Clear everything that a reset clears; machine state and position stay."""
        self._flags = _Flags()
        self._received: deque[int] = deque()
        self._modes = Modes()
        self._reports = StatusReports(self._settings)
        self._steppers.flush()
        self._is_aborted = False
        self._is_suspended = False
        self._is_stopping = False
        self._is_over_limit = False
        self._is_approaching = False
        self._switch_found = False

    def _main(self) -> Program:
        yield from self._sleep(self._config.boot_s)
        self._is_booting = False
        while True:
            self._init()
            self._out += BANNER.encode()
            yield from self._protocol()

    def _protocol(self) -> Program:
        """Read and execute lines until the next reset."""
        if self._state is State.ALARM:
            self._print("[MSG:'$H'|'$X' to unlock]")
        else:
            self._state = State.IDLE
        line = ""
        while True:
            while self._received:
                character = chr(self._received.popleft())
                if character in "\r\n":
                    yield from self._realtime()
                    if self._is_aborted:
                        return
                    code = yield from self._execute(line)
                    self._print("ok" if code == OK else f"error:{code}")
                    line = ""
                elif len(line) < LINE_MEMORY:
                    line += character
            self._auto_start()
            yield from self._realtime()
            if self._is_aborted:
                return
            yield

    def _execute(self, line: str) -> Answer:
        text = _without_comments(line)
        if len(text) > LINE_CHARACTERS:
            return LINE_TOO_LONG
        if not text:
            return OK
        if text[0] == "$":
            return (yield from self._system_command(text))
        if self._state in {State.ALARM, State.JOG}:
            return LOCKED
        return (yield from self._gcode(text))

    def _system_command(self, text: str) -> Answer:
        is_ready = self._state in {State.IDLE, State.ALARM}
        if text == "$":
            self._print(HELP)
        elif text.startswith("$J"):
            return (yield from self._jog(text))
        elif text == "$$":
            if self._state in {State.CYCLE, State.HOLD}:
                return NOT_IDLE
            self._print(*self._settings.lines())
        elif text == "$G":
            self._print(modes_line(self._modes))
        elif text == "$X":
            if self._state is State.ALARM:
                self._print("[MSG:Caution: Unlocked]")
                self._state = State.IDLE
        elif not is_ready:
            return NOT_IDLE
        elif text == "$H":
            return (yield from self._home())
        elif text == "$I":
            self._print(*BUILD_INFO)
        else:
            return self._store_setting(text)
        return OK

    def _store_setting(self, text: str) -> int:
        name, equals, value = text[1:].partition("=")
        try:
            number = float(name)
        except ValueError:
            return INVALID_STATEMENT
        if not equals:
            return INVALID_STATEMENT
        try:
            code = self._settings.store(number, float(value))
        except ValueError:
            return BAD_NUMBER
        self._reports.refresh_offset()
        return code

    def _gcode(self, text: str) -> Answer:
        try:
            block, modes = parse_block(text, self._modes, self._steppers.planned_mm)
        except GcodeError as error:
            return error.code
        if modes.offset_mm != self._modes.offset_mm:
            self._reports.refresh_offset()
        self._modes = modes
        if block.dwell_s is not None:
            yield from self._dwell(block.dwell_s)
        if block.target_mm is not None:
            if self._settings.soft_limits and self._settings.exceeds_travel(block.target_mm):
                yield from self._exceed_soft_limit()
            else:
                yield from self._queue(block)
        return OK

    def _jog(self, text: str) -> Answer:
        if self._state not in {State.IDLE, State.JOG}:
            return NOT_IDLE
        if not text.startswith("$J="):
            return INVALID_STATEMENT
        try:
            block, _ = parse_block(text[3:], self._modes, self._steppers.planned_mm, is_jog=True)
        except GcodeError as error:
            return error.code
        if block.target_mm is not None:
            if self._settings.soft_limits and self._settings.exceeds_travel(block.target_mm):
                return TRAVEL_EXCEEDED
            yield from self._queue(block)
            if self._state is State.IDLE and self._steppers.has_blocks:
                self._state = State.JOG
                self._steppers.begin(self._now_s)
        return OK

    def _queue(self, block: Block) -> Program:
        """Give a block to the planner; waits while it is full."""
        yield from self._realtime()
        while self._steppers.is_full and not self._is_aborted:
            self._auto_start()
            yield from self._realtime()
            if self._steppers.is_full and not self._is_aborted:
                yield
        if not self._is_aborted and block.target_mm is not None:
            self._steppers.add(block.target_mm, block.feed_mm_s)

    def _dwell(self, duration_s: float) -> Program:
        """Wait for the end of all motion, then so long."""
        self._auto_start()
        yield from self._realtime()
        while (self._steppers.has_blocks or self._state is State.CYCLE) and not self._is_aborted:
            yield
            yield from self._realtime()
        until_s = self._now_s + duration_s
        while self._now_s < until_s and not self._is_aborted:
            self._wake_s = until_s
            yield
            yield from self._realtime()
        self._wake_s = None

    def _exceed_soft_limit(self) -> Program:
        """Come to rest, so that the position is kept, then lock up until a reset."""
        if self._state is State.CYCLE:
            self._flags.hold = self._is_over_limit = True
            yield from self._realtime()
            while self._state is not State.IDLE and not self._is_aborted:
                yield
                yield from self._realtime()
            if self._is_aborted:
                return
        self._mc_reset()
        self._flags.alarm = SOFT_LIMIT
        yield from self._realtime()

    # -- homing -------------------------------------------------------------------------------

    def _home(self) -> Answer:
        if not self._settings.homing:
            return SETTING_DISABLED
        self._state = State.HOMING
        self._steppers.flush()
        yield from self._find_switch()
        yield from self._realtime()
        if not self._is_aborted:
            self._steppers.set_counted(-self._settings.values[27])
            self._state = State.IDLE
        return OK

    def _find_switch(self) -> Program:
        """Seek the switch fast, pull off, find it again slowly, pull off.

        Nothing else is looked at on the way, not even `?`; only a reset gets through.
        """
        values = self._settings.values
        axis = AXES.index(self._config.axis)
        seek_mm_s, locate_mm_s, pull_off_mm = values[25] / 60.0, values[24] / 60.0, values[27]
        for search_mm, speed_mm_s in (
            (1.5 * self._settings.max_travel_mm(axis), seek_mm_s),
            (5.0 * pull_off_mm, locate_mm_s),
        ):
            yield from self._homing_leg(search_mm, speed_mm_s, is_approach=True)
            if not self._switch_found:
                self._fail_homing(HOMING_NO_SWITCH)
            yield from self._homing_leg(-pull_off_mm, seek_mm_s, is_approach=False)
            if self._steppers.is_switch_closed:
                self._fail_homing(HOMING_PULL_OFF)

    def _fail_homing(self, code: int) -> None:
        self._flags.alarm = self._flags.alarm or code
        self._mc_reset()

    def _homing_leg(self, way_mm: float, speed_mm_s: float, *, is_approach: bool) -> Program:
        if self._flags.reset:
            return
        self._is_approaching = is_approach
        self._switch_found = False
        self._steppers.seek(self._now_s, way_mm, speed_mm_s)
        while self._steppers.end_s is not None:
            yield
        self._flags.motion_ended = False
        self._is_approaching = False
        if not self._flags.reset:
            yield from self._sleep(self._settings.values[26] * 1e-3)

    # -- realtime commands --------------------------------------------------------------------

    def _realtime(self) -> Program:
        """Look at the flags; stay while motion is suspended."""
        yield from self._handle_flags()
        while self._is_suspended and not self._is_aborted:
            yield
            yield from self._handle_flags()

    def _handle_flags(self) -> Program:
        flags = self._flags
        if flags.alarm:
            yield from self._handle_alarm()
        if flags.reset:
            self._is_aborted = True
            return
        if flags.status:
            flags.status = False
            self._print(self._reports.line(self._snapshot()))
        if flags.hold or flags.cancel:
            self._handle_hold()
        elif flags.start:
            self._handle_start()
        flags.hold = flags.cancel = flags.start = False
        if flags.motion_ended:
            flags.motion_ended = False
            self._handle_end()

    def _handle_alarm(self) -> Program:
        flags = self._flags
        self._state = State.ALARM
        self._print(f"ALARM:{flags.alarm}")
        yield from self._sleep(ALARM_PAUSE_S)
        if flags.alarm in {HARD_LIMIT, SOFT_LIMIT}:
            self._print("[MSG:Reset to continue]")
            flags.reset = False
            while not flags.reset:
                yield
        flags.alarm = 0

    def _handle_hold(self) -> None:
        if self._state is State.ALARM:
            return
        if self._state in {State.CYCLE, State.JOG}:
            self._steppers.brake(self._now_s)
            self._is_stopping = True
            self._is_suspended = self._state is State.JOG
        elif self._state is State.IDLE:
            self._is_suspended = True
        if self._flags.hold and self._state is not State.JOG:
            self._state = State.HOLD

    def _handle_start(self) -> None:
        is_held = self._state is State.HOLD and self._is_suspended
        if self._state is not State.IDLE and not is_held:
            return
        self._is_suspended = self._is_stopping = False
        if self._steppers.has_blocks:
            self._state = State.CYCLE
            self._steppers.begin(self._now_s)
        else:
            self._state = State.IDLE

    def _handle_end(self) -> None:
        """A hold is complete, a jog is cancelled, or all blocks are done."""
        if self._state is State.HOLD and not self._is_over_limit:
            self._is_suspended = True
            return
        if self._state is State.JOG and self._is_stopping:
            self._steppers.flush()
        self._is_suspended = self._is_stopping = False
        self._state = State.IDLE

    def _auto_start(self) -> None:
        if self._steppers.has_blocks:
            self._flags.start = True

    def _snapshot(self) -> Snapshot:
        steppers = self._steppers
        is_pressed = steppers.end_s is None and steppers.is_switch_closed
        return Snapshot(
            state=self._state,
            is_held=self._is_suspended,
            position_mm=steppers.position_mm(self._now_s),
            offset_mm=self._modes.offset_mm,
            speed_mm_s=steppers.speed_mm_s(self._now_s),
            free_blocks=steppers.free_blocks,
            free_bytes=RECEIVE_BYTES - len(self._received),
            switch=self._config.axis if is_pressed else "",
        )

    def _print(self, *lines: str) -> None:
        for line in lines:
            self._out += line.encode() + b"\r\n"


def _is_due(event_s: float | None, now_s: float) -> bool:
    return event_s is not None and event_s <= now_s


def _without_comments(line: str) -> str:
    """Drop blanks, control characters, `/`, `( )` and `;` comments; raise to upper case."""
    kept = ""
    depth = 0
    for character in line:
        if character == ";" and not depth:
            break
        if character == "(":
            depth = 1
        elif character == ")":
            depth = 0
        elif not depth and character > " " and character != "/":
            kept += character.upper()
    return kept
