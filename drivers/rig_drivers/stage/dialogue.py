"""A dialogue over a serial line: replies one by one, nonsense counted, given up on request."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from rig.devices import Clock
from rig.errors import StageAlarmError
from rig_drivers.stage.serial_line import SerialLine

SLICE_S = 0.05
"""Longest wait before somebody who wants to stop the stage is heard."""
QUIET_S = 0.1
"""A line that is silent for so long has said everything."""


@dataclass(frozen=True, slots=True)
class Noise:
    """A line that the controller would not say."""

    text: str


Reply = TypeVar("Reply")


class Dialogue(Generic[Reply]):
    """What a controller says, parsed; one thread reads, any other may cancel.

    Args:
        line: over which it talks.
        clock: of the deadlines.
        device: name used in errors.
        parse: from a line to a reply; never raises.
        notice: sees every reply, wanted or not, before anybody else does.
        refuse: raises for a reply that nobody asks for, such as an alarm.
    """

    def __init__(
        self,
        line: SerialLine,
        clock: Clock,
        device: str,
        *,
        parse: Callable[[str], Reply],
        notice: Callable[[Reply], None],
        refuse: Callable[[Reply], None],
    ) -> None:
        self._line = line
        self._clock = clock
        self._device = device
        self._parse = parse
        self._notice = notice
        self._refuse = refuse
        self._noise = 0
        self._cancelling = threading.Event()
        self._cancels = 0
        self._begun_at = 0

    def restart(self) -> None:
        """Forget everything: the port has just been opened."""
        self._noise = 0
        self._cancelling.clear()
        self.begin()

    def write(self, data: bytes) -> None:
        """Send bytes; from any thread."""
        self._line.write(data)

    # -- giving up ----------------------------------------------------------------------------

    def begin(self) -> None:
        """Begin something new: what was cancelled before does not touch it.

        Raises:
            StageAlarmError: a stop is still under way.
        """
        self._begun_at = self._cancels
        self.check_cancelled()

    def cancel(self) -> None:
        """Make whatever has begun give up; from any thread."""
        self._cancels += 1
        self._cancelling.set()

    def resume(self) -> None:
        """Let new things begin after `cancel`."""
        self._cancelling.clear()

    def check_cancelled(self) -> None:
        """See that nobody has cancelled what was begun.

        Raises:
            StageAlarmError: somebody has; code "stopped".
        """
        if self._cancelling.is_set() or self._cancels != self._begun_at:
            raise StageAlarmError(
                self._device,
                "stopped on request",
                advice="move again when it is safe",
                code="stopped",
            )

    # -- reading ------------------------------------------------------------------------------

    def next(self, deadline_s: float) -> Reply | None:
        """Return the next reply, whatever it is; None if there is none before the deadline."""
        text = self._line.read_line(deadline_s - self._clock.now_s())
        if text is None:
            return None
        reply = self._parse(text)
        if isinstance(reply, Noise):
            self._noise += 1
        self._notice(reply)
        return reply

    def heed(self, deadline_s: float) -> Reply | None:
        """Return the next reply, but raise what nobody asked for, and give up when cancelled.

        Raises:
            StageAlarmError: cancelled, or whatever `refuse` raises.
        """
        while True:
            now_s = self._clock.now_s()
            reply = self.next(min(deadline_s, now_s + SLICE_S))
            self.check_cancelled()
            if reply is not None:
                self._refuse(reply)
                return reply
            if now_s >= deadline_s:
                return None

    def heed_past(self) -> None:
        """Take what has already arrived; raises like `heed`."""
        while (reply := self.next(self._clock.now_s())) is not None:
            self._refuse(reply)
        self.check_cancelled()

    def drain(self) -> None:
        """Read until the line is quiet."""
        while self.next(self._clock.now_s() + QUIET_S) is not None:
            pass

    def noise_note(self) -> str:
        """Say how much nonsense came over the line, if any did."""
        lines, loose = self._noise, self._line.noise_bytes
        return f" ({lines} damaged lines, {loose} loose bytes came)" if lines or loose else ""
