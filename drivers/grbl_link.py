"""The dialogue with a GRBL controller: ask, wait for the answer, notice what nobody asked for."""

import threading
from collections.abc import Iterable, Iterator

from drivers.grbl_dialect import (
    Alarm,
    Banner,
    Message,
    Noise,
    Ok,
    Refused,
    Reply,
    Setting,
    Status,
    alarm_text,
    parse_reply,
    refusal_text,
)
from drivers.serial_line import SerialLine
from rig.devices import Clock
from rig.errors import (
    DeviceLostError,
    DeviceNotFoundError,
    StageAlarmError,
    StageTimeoutError,
)

BANNER_TIMEOUT_S = 3.0
"""Opening the port resets an Uno; its banner comes after 1-2 s."""
QUIET_S = 0.1
"""A line that is silent for so long has said everything."""
ANSWER_TIMEOUT_S = 2.0
STATUS_TIMEOUT_S = 0.3
"""`?` is answered within milliseconds; later it was lost and is asked again."""
STATUS_ATTEMPTS = 6
POLL_S = 0.05
RESET_ATTEMPTS = 3

RESET = b"\x18"
HOLD = b"!"
STATUS = b"?"

STATES_AT_REST = ("Idle", "Hold:0", "Alarm", "Check", "Sleep")


class GrblLink:
    """One conversation with one controller.

    An alarm or a banner that was not asked for is raised from whatever call reads it: the first
    means that motion was stopped, the second that the controller was reset.
    """

    def __init__(self, line: SerialLine, clock: Clock, device: str) -> None:
        self._line = line
        self._clock = clock
        self._device = device
        self._offset_mm: tuple[float, ...] | None = None
        self._cancelled = threading.Event()

    def connect(self) -> Banner:
        """Wait for the banner of a controller that has just been opened.

        Raises:
            DeviceNotFoundError: nothing like GRBL 1.1 answered.
        """
        self._cancelled.clear()
        banner = self._await_banner(BANNER_TIMEOUT_S)
        if banner is None:
            self._line.write(RESET)
            banner = self._await_banner(BANNER_TIMEOUT_S)
        if banner is None:
            raise DeviceNotFoundError(
                self._device,
                f"asked for GRBL, no banner came within {2 * BANNER_TIMEOUT_S:.0f} s; "
                "check port, baud rate and the controller's supply",
            )
        if banner.version.startswith("0.") or banner.version < "1.1":
            raise DeviceNotFoundError(
                self._device,
                f"found GRBL {banner.version}, this driver needs 1.1; update the firmware",
            )
        self._drain()
        return banner

    # -- asking -------------------------------------------------------------------------------

    def command(self, text: str, timeout_s: float = ANSWER_TIMEOUT_S) -> list[Message | Setting]:
        """Send one line and return what was printed before its `ok`.

        Raises:
            StageAlarmError: refused, stopped by an alarm, reset, or cancelled.
            StageTimeoutError: no answer in time.
        """
        self.absorb()
        self._check_cancelled()
        self._line.write(text.encode("ascii") + b"\n")
        printed: list[Message | Setting] = []
        for reply in self._replies(timeout_s):
            match reply:
                case Ok():
                    return printed
                case Refused(code):
                    raise StageAlarmError(
                        self._device,
                        f"{text} was refused, {refusal_text(code)}",
                        code=f"error:{code}",
                    )
                case Message() | Setting():
                    printed.append(reply)
                case _:
                    pass
        raise StageTimeoutError(
            self._device,
            f"{text} got no answer within {timeout_s:.1f} s; check cable and supply",
            timeout_s=timeout_s,
        )

    def status(self) -> Status:
        """Ask for a status report.

        Raises:
            StageAlarmError: stopped by an alarm, reset, or cancelled.
            StageTimeoutError: no report came, though asked for several times.
        """
        for _ in range(STATUS_ATTEMPTS):
            self._line.write(STATUS)
            for reply in self._replies(STATUS_TIMEOUT_S):
                if isinstance(reply, Status):
                    self._offset_mm = reply.offset_mm or self._offset_mm
                    return reply
        timeout_s = STATUS_ATTEMPTS * STATUS_TIMEOUT_S
        raise StageTimeoutError(
            self._device,
            f"no status report within {timeout_s:.1f} s; check cable and supply",
            timeout_s=timeout_s,
        )

    def position_mm(self, axis: int, deadline_s: float) -> tuple[str, float]:
        """Wait for rest, then return state and machine coordinate, read twice alike.

        Twice, because a damaged report can look like a good one.

        Raises:
            StageAlarmError: stopped by an alarm, reset, or cancelled.
            StageTimeoutError: still moving at the deadline, or no two reports agreed.
        """
        start_s = self._clock.now_s()
        before: tuple[str, float | None] | None = None
        while True:
            status = self.status()
            now = (status.state, self._machine_mm(status, axis))
            if now[1] is not None and now == before and status.state in STATES_AT_REST:
                return status.state, now[1]
            before = now
            if self._clock.now_s() >= deadline_s:
                break
            if status.state not in STATES_AT_REST:
                self._clock.sleep_s(min(POLL_S, deadline_s - self._clock.now_s()))
        waited_s = self._clock.now_s() - start_s
        raise StageTimeoutError(
            self._device,
            f"not at rest after {waited_s:.1f} s (state {status.state}); "
            "allow more time or raise the speed",
            timeout_s=waited_s,
        )

    # -- stopping -----------------------------------------------------------------------------

    def cancel(self, data: bytes) -> None:
        """Send a realtime command from any thread, and make the call that waits give up."""
        self._cancelled.set()
        self._line.write(data)

    def resume(self) -> None:
        """Take commands again after `cancel`."""
        self._cancelled.clear()

    def hold(self, timeout_s: float) -> bool:
        """Brake without losing steps; returns whether rest was confirmed in time."""
        deadline_s = self._clock.now_s() + timeout_s
        while self._clock.now_s() < deadline_s:
            self._line.write(HOLD + STATUS)
            for reply in self._raw_replies(STATUS_TIMEOUT_S):
                if isinstance(reply, Alarm | Banner):
                    return True
                if isinstance(reply, Status):
                    if reply.state in STATES_AT_REST:
                        return True
                    break
            self._clock.sleep_s(POLL_S)
        return False

    def reset(self) -> bool:
        """Clear everything queued; returns whether the controller kept its position.

        Raises:
            DeviceLostError: it does not come back.
        """
        for _ in range(RESET_ATTEMPTS):
            self._line.write(RESET)
            is_kept = True
            for reply in self._raw_replies(BANNER_TIMEOUT_S):
                is_kept = is_kept and not isinstance(reply, Alarm)
                if isinstance(reply, Banner):
                    self._drain()
                    return is_kept and self._is_idle()
        raise DeviceLostError(
            self._device,
            f"did not come back from {RESET_ATTEMPTS} resets; the stage may still be moving: "
            "switch its supply off",
        )

    def absorb(self) -> None:
        """Look at what has come meanwhile.

        Raises:
            StageAlarmError: an alarm or a reset was among it.
        """
        for reply in self._raw_replies(0.0):
            self._raise_event(reply)

    # -- reading ------------------------------------------------------------------------------

    def _replies(self, timeout_s: float) -> Iterator[Reply]:
        """Yield replies until the timeout, raising what nobody asked for."""
        for reply in self._raw_replies(timeout_s):
            self._raise_event(reply)
            yield reply
            self._check_cancelled()

    def _raw_replies(self, timeout_s: float) -> Iterator[Reply]:
        deadline_s = self._clock.now_s() + timeout_s
        while True:
            left_s = deadline_s - self._clock.now_s()
            text = self._line.read_line(max(0.0, min(left_s, POLL_S)))
            if text is not None:
                yield parse_reply(text)
            elif left_s <= 0.0:
                return
            else:
                yield Noise("")

    def _await_banner(self, timeout_s: float) -> Banner | None:
        return _first_banner(self._raw_replies(timeout_s))

    def _drain(self) -> None:
        """Read until the line is quiet."""
        while self._line.read_line(QUIET_S) is not None:
            pass

    def _is_idle(self) -> bool:
        for _ in range(STATUS_ATTEMPTS):
            self._line.write(STATUS)
            for reply in self._raw_replies(STATUS_TIMEOUT_S):
                if isinstance(reply, Status):
                    return reply.state == "Idle"
        return False

    def _raise_event(self, reply: Reply) -> None:
        if isinstance(reply, Alarm):
            raise StageAlarmError(self._device, alarm_text(reply.code), code=f"ALARM:{reply.code}")
        if isinstance(reply, Banner):
            raise StageAlarmError(
                self._device,
                "the controller was reset by somebody else or by its supply, the position is "
                "lost; check the supply and home again",
                code="reset",
            )

    def _check_cancelled(self) -> None:
        if self._cancelled.is_set():
            raise StageAlarmError(
                self._device, "stopped on request; move again when it is safe", code="stopped"
            )

    def _machine_mm(self, status: Status, axis: int) -> float | None:
        """Return the machine coordinate; None while the work offset is not known yet."""
        if status.machine_mm is not None:
            return status.machine_mm[axis]
        if status.work_mm is None or self._offset_mm is None:
            return None
        return status.work_mm[axis] + self._offset_mm[axis]


def _first_banner(replies: Iterable[Reply]) -> Banner | None:
    return next((reply for reply in replies if isinstance(reply, Banner)), None)
