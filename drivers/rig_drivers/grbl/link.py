"""The dialogue with a GRBL controller: ask, wait for the answer, notice what nobody asked for."""

from rig.devices import Clock
from rig.errors import (
    DeviceLostError,
    DeviceNotFoundError,
    StageAlarmError,
    StageTimeoutError,
)
from rig_drivers.grbl.dialect import (
    STANDSTILLS,
    Alarm,
    Banner,
    Dialect,
    Message,
    Ok,
    Refused,
    Reply,
    Setting,
    Status,
    alarm,
    parse_reply,
    refusal,
)
from rig_drivers.stage.dialogue import QUIET_S, SLICE_S, Dialogue
from rig_drivers.stage.serial_line import SerialLine

BANNER_TIMEOUT_S = 3.0
"""Opening the port resets an Uno; its banner comes after 1-2 s."""
BOOT_SILENCE_S = 6.0
"""FluidNC with WiFi says every 2 s that it is connecting, and gives its banner after 8-10 s;"""
BOOT_TIMEOUT_S = 60.0
"""no network keeps it for longer than this."""
ANSWER_TIMEOUT_S = 2.0
STATUS_TIMEOUT_S = 0.3
"""`?` is answered within milliseconds; later it was lost and is asked again."""
STATUS_ATTEMPTS = 6
REREAD_S = 0.01
"""Pause between two readings of a position at rest."""
RESET_ATTEMPTS = 3

RESET = b"\x18"
HOLD = b"!"
STATUS = b"?"


class GrblLink:
    """One conversation with one controller.

    An alarm or a banner that was not asked for is raised from whatever call reads it: the first
    means that motion was stopped, the second that the controller was reset. After both the
    position is lost.
    """

    def __init__(self, line: SerialLine, clock: Clock, device: str) -> None:
        self._clock = clock
        self._device = device
        self._dialogue = Dialogue(
            line, clock, device, parse=parse_reply, notice=self._notice, refuse=self._refuse
        )
        self._offset_mm: tuple[float, ...] | None = None
        self._dialect = Dialect.GRBL
        self.is_homed = False
        """Whether machine coordinates mean anything; set after homing, cleared when lost."""

    def connect(self) -> Banner:
        """Wait for the banner of a controller whose port has just been opened.

        Raises:
            DeviceNotFoundError: nothing like GRBL 1.1 answered.
        """
        self._dialogue.restart()
        self._offset_mm = None
        self.is_homed = False
        start_s = self._clock.now_s()
        banner = self._await_banner(boots=True)
        if banner is None:
            self._dialogue.write(RESET)
            banner = self._await_banner(boots=True)
        if banner is None:
            waited_s = self._clock.now_s() - start_s
            raise DeviceNotFoundError(
                self._device,
                f"asked for GRBL, no banner came within {waited_s:.0f} s"
                f"{self._dialogue.noise_note()}",
                advice="check port, baud rate and the controller's supply",
            )
        if banner.number < (1, 1):
            raise DeviceNotFoundError(
                self._device,
                f"found GRBL {banner.version}, this driver needs 1.1",
                advice="update the firmware",
            )
        self._dialect = banner.dialect
        self._drain()
        return banner

    # -- asking -------------------------------------------------------------------------------

    def begin(self) -> None:
        """Begin something new: what was cancelled before does not touch it.

        Raises:
            StageAlarmError: a stop is still under way.
        """
        self._dialogue.begin()

    def command(self, text: str, timeout_s: float = ANSWER_TIMEOUT_S) -> list[Message | Setting]:
        """Send one line and return what was printed before its `ok`.

        Raises:
            StageAlarmError: refused, stopped by an alarm, reset, or cancelled.
            StageTimeoutError: no answer in time.
        """
        self._dialogue.heed_past()
        self._dialogue.write(text.encode("ascii") + b"\n")
        printed: list[Message | Setting] = []
        deadline_s = self._clock.now_s() + timeout_s
        while (reply := self._dialogue.heed(deadline_s)) is not None:
            if isinstance(reply, Ok):
                return printed
            if isinstance(reply, Refused):
                raise refusal(self._device, text, reply.code, self._dialect)
            if isinstance(reply, Message | Setting):
                printed.append(reply)
        raise StageTimeoutError(
            self._device,
            f"{text} got no answer within {timeout_s:.1f} s{self._dialogue.noise_note()}",
            advice="check cable and supply",
            timeout_s=timeout_s,
        )

    def status(self) -> Status:
        """Ask for a status report.

        Raises:
            StageAlarmError: stopped by an alarm, reset, or cancelled.
            StageTimeoutError: no report came, though asked for several times.
        """
        for _ in range(STATUS_ATTEMPTS):
            self._dialogue.write(STATUS)
            deadline_s = self._clock.now_s() + STATUS_TIMEOUT_S
            while (reply := self._dialogue.heed(deadline_s)) is not None:
                if isinstance(reply, Status):
                    self._offset_mm = reply.offset_mm or self._offset_mm
                    self.is_homed = self.is_homed and not reply.state.startswith("Alarm")
                    return reply
        timeout_s = STATUS_ATTEMPTS * STATUS_TIMEOUT_S
        raise StageTimeoutError(
            self._device,
            f"no status report within {timeout_s:.1f} s{self._dialogue.noise_note()}",
            advice="check cable and supply",
            timeout_s=timeout_s,
        )

    def rest(self, axis: int, timeout_s: float) -> tuple[str, float] | None:
        """Wait for rest and return state and machine coordinate (mm), read twice alike.

        Twice, because a damaged report can look like a good one.

        Returns:
            None if there was no rest in time.

        Raises:
            StageAlarmError: stopped by an alarm, reset, or cancelled.
            StageTimeoutError: no report came.
        """
        deadline_s = self._clock.now_s() + timeout_s
        before: tuple[str, float | None] | None = None
        while True:
            status = self.status()
            state, machine_mm = status.state, self._machine_mm(status, axis)
            is_at_rest = _is_at_rest(state)
            if is_at_rest and machine_mm is not None and (state, machine_mm) == before:
                return state, machine_mm
            before = (state, machine_mm)
            left_s = deadline_s - self._clock.now_s()
            if left_s <= 0.0:
                return None
            self._clock.sleep_s(min(left_s, REREAD_S if is_at_rest else SLICE_S))

    # -- stopping -----------------------------------------------------------------------------

    def cancel(self, command: bytes) -> None:
        """Send a realtime command from any thread, and make whatever has begun give up."""
        self._dialogue.cancel()
        self._dialogue.write(command)

    def resume(self) -> None:
        """Let new things begin after `cancel`."""
        self._dialogue.resume()

    def hold(self, timeout_s: float) -> None:
        """Brake without losing steps, and wait for rest; at the timeout `reset` will tell."""
        deadline_s = self._clock.now_s() + timeout_s
        while self._clock.now_s() < deadline_s:
            self._dialogue.write(HOLD + STATUS)
            answer_s = self._clock.now_s() + STATUS_TIMEOUT_S
            while (reply := self._dialogue.next(answer_s)) is not None:
                if isinstance(reply, Banner):
                    self.is_homed = False
                if isinstance(reply, Alarm | Banner):
                    return
                if isinstance(reply, Status):
                    if _is_at_rest(reply.state):
                        return
                    break
            self._clock.sleep_s(SLICE_S)

    def reset(self) -> None:
        """Clear everything that is queued; the position is lost if the controller says so.

        Raises:
            DeviceLostError: the controller does not come back.
        """
        for _ in range(RESET_ATTEMPTS):
            self._dialogue.write(RESET)
            if self._await_banner() is not None:
                self._drain()
                self.is_homed = self.is_homed and self._is_unlocked()
                return
        raise DeviceLostError(
            self._device,
            f"did not come back from {RESET_ATTEMPTS} resets{self._dialogue.noise_note()}",
            advice="the stage may still be moving: switch its supply off",
        )

    # -- reading ------------------------------------------------------------------------------

    def _await_banner(self, *, boots: bool = False) -> Banner | None:
        """Wait for the banner; where the controller boots, as long as it says that it does."""
        start_s = self._clock.now_s()
        deadline_s = start_s + BANNER_TIMEOUT_S
        while (reply := self._dialogue.next(deadline_s)) is not None:
            if isinstance(reply, Banner):
                return reply
            if boots and isinstance(reply, Message) and reply.kind == "MSG":
                now_s = self._clock.now_s()
                deadline_s = min(now_s + BOOT_SILENCE_S, start_s + BOOT_TIMEOUT_S)
        return None

    def _drain(self) -> None:
        """Read until the line is quiet; a second banner means another reset."""
        while (reply := self._dialogue.next(self._clock.now_s() + QUIET_S)) is not None:
            if isinstance(reply, Banner):
                self.is_homed = False

    def _is_unlocked(self) -> bool:
        """Whether the reset has kept the position; a hold may come late from another thread."""
        for _ in range(STATUS_ATTEMPTS):
            self._dialogue.write(STATUS)
            deadline_s = self._clock.now_s() + STATUS_TIMEOUT_S
            while (reply := self._dialogue.next(deadline_s)) is not None:
                if isinstance(reply, Status):
                    return reply.state in {"Idle", "Hold:0"}
        return False

    def _notice(self, reply: Reply) -> None:
        if isinstance(reply, Alarm):
            self.is_homed = False

    def _refuse(self, reply: Reply) -> None:
        if isinstance(reply, Alarm):
            raise alarm(self._device, reply.code, self._dialect)
        if isinstance(reply, Banner):
            self.is_homed = False
            raise StageAlarmError(
                self._device,
                "the controller was reset by somebody else or by its supply, the position is lost",
                advice="check the supply and home again",
                code="reset",
            )

    def _machine_mm(self, status: Status, axis: int) -> float | None:
        """Return the machine coordinate; None while the work offset is not known yet."""
        if status.machine_mm is not None:
            return status.machine_mm[axis]
        if status.work_mm is None or self._offset_mm is None:
            return None
        return status.work_mm[axis] + self._offset_mm[axis]


def _is_at_rest(state: str) -> bool:
    """Whether nothing moves; some dialects say after a colon which alarm it is."""
    return state == "Idle" or state in STANDSTILLS or state.partition(":")[0] == "Alarm"
