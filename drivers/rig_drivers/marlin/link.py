"""The dialogue with a Marlin controller: numbered lines, each answered before the next is sent."""

from rig.devices import Clock
from rig.errors import DeviceLostError, DeviceNotFoundError, StageAlarmError, StageTimeoutError
from rig_drivers.marlin.dialect import (
    FAILING,
    KILLED,
    KLIPPER,
    Ok,
    Position,
    Remark,
    Reply,
    Resend,
    Start,
    Trouble,
    alarm,
    klipper,
    numbered_line,
    parse_reply,
)
from rig_drivers.marlin.listening import ATTEMPTS, SILENCE_S, Listener, Silence
from rig_drivers.stage.dialogue import Dialogue
from rig_drivers.stage.serial_line import SerialLine

START_TIMEOUT_S = 4.0
"""Opening the port resets most boards; the boot loader takes 1-2 s. Others say nothing."""
ANSWER_TIMEOUT_S = 5.0
KILL_S = 1.0
"""A controller that fails says so, and halts at once."""


class MarlinLink:
    """One conversation with one controller.

    One line is under way at a time. A damaged one is asked for again by its number, so nothing is
    done twice. Where it is unclear what was taken, a spoken token (M118) settles it: the controller
    works in order, so whoever hears the token knows that everything before it is done.
    """

    def __init__(self, line: SerialLine, clock: Clock, device: str) -> None:
        self._clock = clock
        self._device = device
        self._dialogue: Dialogue[Reply] = Dialogue(
            line, clock, device, parse=parse_reply, notice=self._notice, refuse=self._refuse
        )
        self._listener = Listener(self._dialogue, clock)
        self._next = 1
        self._tokens = 0
        self._is_in_step = False
        self.is_homed = False
        """Whether coordinates mean anything; set after homing, cleared when lost."""
        self.is_killed = False
        """Whether the controller has halted for good; its motors have no current then."""
        self.is_failing = False
        """Whether it has told a fault after which it halts."""
        self.fault = ""
        """The first thing that it said of a fault or halt."""
        self.is_stopped = False
        """Whether an error has stopped the controller; it moves nothing until told to (M999)."""

    def connect(self) -> None:
        """Get in step with a controller whose port has just been opened.

        Raises:
            DeviceNotFoundError: nothing like Marlin answered.
            StageAlarmError: it has halted already.
        """
        self._dialogue.restart()
        self.is_homed = self.is_killed = self.is_failing = self.is_stopped = False
        self._is_in_step = False
        self.fault = ""
        deadline_s = self._clock.now_s() + START_TIMEOUT_S
        while (reply := self._dialogue.next(deadline_s)) is not None:
            if isinstance(reply, Start):
                break
        self._dialogue.drain()
        if self.fault:
            raise alarm(self._device, self.fault)
        try:
            self._restart_numbers()
        except StageAlarmError as error:
            raise (
                klipper(self._device, error.symptom) if error.code == KLIPPER else error
            ) from error
        except StageTimeoutError as error:
            raise DeviceNotFoundError(
                self._device,
                f"asked for Marlin, nothing answered{self._dialogue.noise_note()}",
                advice="check port, baud rate (115200 or 250000) and the controller's supply",
            ) from error

    def begin(self) -> None:
        """Begin something new; raises if a stop is still under way."""
        self._dialogue.begin()

    # -- asking -------------------------------------------------------------------------------

    def command(
        self, text: str, timeout_s: float = ANSWER_TIMEOUT_S, *, heeds: bool = True
    ) -> list[Position | Remark]:
        """Send one command and return what was printed before its `ok`.

        Args:
            text: the command.
            timeout_s: longest time that it may be at work.
            heeds: whether alarms are raised and a stop on request ends the call.

        Raises:
            StageAlarmError: refused, stopped, reset, out of step, or cancelled.
            StageTimeoutError: no answer in time.
        """
        if not self._is_in_step:
            self.speak_up(heeds=heeds)
        if heeds:
            self._dialogue.heed_past()
        self._is_in_step = False
        printed: list[Position | Remark] = []
        for _ in range(ATTEMPTS):
            self._dialogue.write(numbered_line(self._next, text))
            answer = self._listener.answer(self._next, printed, timeout_s, heeds=heeds)
            if isinstance(answer, Ok):
                self._next += 1
                self._is_in_step = True
                return printed
            if answer is Silence.LATE:
                break
            if isinstance(answer, Resend):
                self._dialogue.drain()
                if answer.number == self._next + 1:  # taken before; only its answer was lost
                    self._next = answer.number
                    self.speak_up(heeds=heeds)
                    return printed
                if answer.number != self._next:
                    raise self._out_of_step(answer)
        raise self._timeout(text, timeout_s)

    def speak_up(self, *, heeds: bool = True, is_certain: bool = False) -> None:
        """Have the controller say a token, which proves that all before it is done.

        Args:
            heeds: see `command`.
            is_certain: whether every line before is known to have been taken; an older one that is
                asked for again is then an error.

        Raises:
            StageAlarmError, StageTimeoutError: see `command`.
        """
        self._is_in_step = False
        for _ in range(ATTEMPTS):
            self._tokens += 1
            token = f"rig{self._tokens}"
            self._dialogue.write(numbered_line(self._next, f"M118 {token}"))
            answer = self._listener.token(token, heeds=heeds)
            if isinstance(answer, Resend):
                if is_certain and answer.number < self._next:
                    raise self._out_of_step(answer)
                # An earlier token of ours may have been taken after all.
                self._next = answer.number
                self._dialogue.drain()
            elif answer is not None:
                self._next += 1
                self._dialogue.drain()
                self._is_in_step = True
                return
        raise self._timeout("M118", ATTEMPTS * SILENCE_S)

    def ask(self, text: str, wanted: str) -> list[str]:
        """Send a question and return the lines of its answer.

        Args:
            text: the question.
            wanted: what stands in one of the lines. Where it has not come before the `ok`, it is
                waited for: some old firmwares answer afterwards.

        Raises:
            StageAlarmError, StageTimeoutError: see `command`.
        """
        lines = [reply.text for reply in self.command(text) if isinstance(reply, Remark)]
        if not any(wanted in line for line in lines):
            late = self._listener.afterwards()
            lines += [reply.text for reply in late if isinstance(reply, Remark)]
        return lines

    def position(self) -> Position:
        """Ask for the position (M114; R where the firmware knows it).

        Raises:
            StageAlarmError, StageTimeoutError: see `command`.
        """
        for _ in range(ATTEMPTS):
            said: list[Reply] = [*self.command("M114 R")]
            if not any(isinstance(reply, Position) for reply in said):
                said += self._listener.afterwards()
            for reply in said:
                if isinstance(reply, Position):
                    return reply
        raise self._timeout("M114", ATTEMPTS * ANSWER_TIMEOUT_S)

    # -- stopping -----------------------------------------------------------------------------

    def cancel(self, command: bytes) -> None:
        """Send an urgent command from any thread, and make whatever has begun give up."""
        self._dialogue.cancel()
        self.urge(command)

    def resume(self) -> None:
        """Let new things begin after `cancel`."""
        self._dialogue.resume()

    def urge(self, command: bytes) -> None:
        """Send a command without a number, which is heeded before those that wait their turn."""
        self._is_in_step = False
        self._dialogue.write(b"\n" + command + b"\n")

    def kill(self) -> None:
        """Halt the controller for good; only a reset wakes it up again.

        Raises:
            DeviceLostError: it does not confirm.
        """
        self.is_homed = False
        for _ in range(ATTEMPTS):
            self.urge(b"M112")
            deadline_s = self._clock.now_s() + SILENCE_S
            while not self.is_killed and self._dialogue.next(deadline_s) is not None:
                pass
            if self.is_killed:
                return
        raise DeviceLostError(
            self._device,
            f"did not confirm {ATTEMPTS} emergency stops (M112){self._dialogue.noise_note()}",
            advice="the stage may still be moving: switch its supply off",
        )

    # -- reading ------------------------------------------------------------------------------

    def halts(self) -> bool:
        """Whether the controller has halted, or does so now because of a fault that it told."""
        deadline_s = self._clock.now_s() + KILL_S
        while self.is_failing and not self.is_killed:
            if self._dialogue.next(deadline_s) is None:
                break
        return self.is_killed

    def _restart_numbers(self) -> None:
        for _ in range(ATTEMPTS):
            self._dialogue.write(b"\n")  # ends what another program may have begun
            self._dialogue.drain()
            self._next = 0
            self._dialogue.write(numbered_line(0, "M110 N0"))
            if isinstance(self._listener.answer(self._next, [], ANSWER_TIMEOUT_S, heeds=True), Ok):
                self._next = 1
                self._dialogue.drain()
                self.speak_up()
                return
        raise self._timeout("M110", ATTEMPTS * SILENCE_S)

    def _notice(self, reply: Reply) -> None:
        if isinstance(reply, Start):
            self.is_homed = self._is_in_step = False
        if isinstance(reply, Trouble):
            code = alarm(self._device, reply.text).code
            self.is_killed = self.is_killed or code == KILLED
            self.is_failing = self.is_failing or code == FAILING
            if code in {KILLED, FAILING}:
                self.fault = self.fault or reply.text
            self.is_stopped = self.is_stopped or code == "stopped by error"
            self.is_homed = self.is_homed and code == "unknown command"

    def _refuse(self, reply: Reply) -> None:
        if isinstance(reply, Trouble):
            raise alarm(self._device, reply.text)
        if isinstance(reply, Start):
            raise StageAlarmError(
                self._device,
                "the controller was reset by somebody else or by its supply, the position is lost",
                advice="check the supply and home again",
                code="reset",
            )

    def _out_of_step(self, answer: Resend) -> StageAlarmError:
        return StageAlarmError(
            self._device,
            f"the controller wants line {answer.number} again, line {self._next} was sent, so it "
            "missed a command",
            advice="check the cable for noise",
            code="out of step",
        )

    def _timeout(self, text: str, timeout_s: float) -> StageTimeoutError:
        return StageTimeoutError(
            self._device,
            f"{text} got no answer within {timeout_s:.1f} s{self._dialogue.noise_note()}",
            advice="check cable and supply",
            timeout_s=timeout_s,
        )
