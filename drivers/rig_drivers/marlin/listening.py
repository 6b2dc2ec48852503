"""Waiting for what a Marlin controller says: an answer, a token, or what comes afterwards."""

from enum import Enum

from rig.devices import Clock
from rig_drivers.marlin.dialect import Busy, Ok, Position, Remark, Reply, Resend
from rig_drivers.stage.dialogue import QUIET_S, Dialogue

SILENCE_S = 3.0
"""A working controller says at least `busy` every second, as this driver tells it to (M113)."""
ATTEMPTS = 4
"""How often something is said before it is given up."""


class Silence(Enum):
    """Why an answer did not come."""

    SILENT = "the controller fell silent"
    LATE = "the command took too long"


class Listener:
    """Hears one controller.

    Args:
        dialogue: with it.
        clock: of the deadlines.
    """

    def __init__(self, dialogue: Dialogue[Reply], clock: Clock) -> None:
        self._dialogue = dialogue
        self._clock = clock

    def answer(
        self, number: int, printed: list[Position | Remark], timeout_s: float, *, heeds: bool
    ) -> Ok | Resend | Silence:
        """Wait for the answer to a line.

        Args:
            number: of the line; an `ok` with another one is of an earlier line.
            printed: takes what is said before.
            timeout_s: longest time that the line may be at work.
            heeds: whether alarms are raised and a stop on request ends the wait.

        Raises:
            StageAlarmError: where it heeds them.
        """
        deadline_s = self._clock.now_s() + timeout_s
        silent_s = self._clock.now_s() + SILENCE_S
        while True:
            reply = self._listen(min(deadline_s, silent_s), heeds=heeds)
            match reply:
                case None:
                    is_late = self._clock.now_s() >= deadline_s
                    return Silence.LATE if is_late else Silence.SILENT
                case Ok() if reply.number in {None, number}:
                    printed += [] if reply.position is None else [reply.position]
                    printed += [Remark(reply.text)] if reply.text else []
                    return reply
                case Resend():
                    return reply
                case Busy():
                    silent_s = self._clock.now_s() + SILENCE_S
                    if self._clock.now_s() >= deadline_s:
                        return Silence.LATE
                case Position() | Remark():
                    printed.append(reply)
                case _:
                    pass

    def token(self, token: str, *, heeds: bool) -> Remark | Resend | None:
        """Return the token, or a request to send again, or nothing after a silence."""
        silent_s = self._clock.now_s() + SILENCE_S
        deadline_s = self._clock.now_s() + ATTEMPTS * SILENCE_S
        while (reply := self._listen(min(silent_s, deadline_s), heeds=heeds)) is not None:
            if isinstance(reply, Busy):
                silent_s = self._clock.now_s() + SILENCE_S
            if isinstance(reply, Resend):
                return reply
            if isinstance(reply, Remark) and reply.text.removeprefix("echo:").strip() == token:
                return reply
        return None

    def afterwards(self) -> list[Reply]:
        """Return what comes after an `ok`, until the line is quiet."""
        replies: list[Reply] = []
        while (reply := self._dialogue.heed(self._clock.now_s() + QUIET_S)) is not None:
            replies.append(reply)
        return replies

    def _listen(self, deadline_s: float, *, heeds: bool) -> Reply | None:
        return self._dialogue.heed(deadline_s) if heeds else self._dialogue.next(deadline_s)
