"""The dialogue with one device of a Zaber chain: each answer belongs to a numbered command."""

from collections.abc import Iterator

from rig.devices import Clock
from rig.errors import ConfigError, DeviceNotFoundError, StageAlarmError, StageTimeoutError
from rig.profile import ZaberStageConfig
from rig_drivers.stage.dialogue import Dialogue, Noise
from rig_drivers.stage.serial_line import SerialLine
from rig_drivers.zaber.binary import BINARY_BAUD, binary_devices
from rig_drivers.zaber.message import Alert, Answer, Message, command_line, parse_message
from rig_drivers.zaber.words import refusal

ANSWER_TIMEOUT_S = 0.5
"""A device answers within milliseconds; later the answer was lost."""
ATTEMPTS = 4
BOOT_ATTEMPTS = 8
"""A device whose supply comes with its port needs some seconds."""
NUMBERS = 100
WHOLE_DEVICE = 0


class ZaberLink:
    """One conversation with one device and one of its axes.

    Answers of other devices, answers to other numbers and alerts are passed over; a line with a
    wrong checksum is noise, so a damaged command or answer is a lost one.
    """

    def __init__(self, config: ZaberStageConfig, line: SerialLine, clock: Clock, name: str) -> None:
        self._config = config
        self._line = line
        self._clock = clock
        self._device = name
        self._number = 0
        self.dialogue: Dialogue[Message] = Dialogue(
            line, clock, name, parse=self._parse, notice=lambda _: None, refuse=lambda _: None
        )

    def connect(self) -> None:
        """See that the device is there and speaks as the profile says.

        Raises:
            DeviceNotFoundError: nothing answered.
            ConfigError: the device answers without checksums.
        """
        self.dialogue.restart()
        self.dialogue.drain()
        try:
            self.ask("", axis=WHOLE_DEVICE, attempts=BOOT_ATTEMPTS)
        except StageTimeoutError as error:
            raise self._not_found() from error

    def ask(
        self,
        text: str,
        *,
        axis: int | None = None,
        attempts: int = ATTEMPTS,
        heeds: bool = True,
    ) -> Answer:
        """Send a command and return its answer.

        Args:
            text: the command.
            axis: of the device; None for the profile's axis.
            attempts: how often it may be sent. A command that starts a motion is sent once: after
                a lost answer nobody knows whether it moves.
            heeds: whether the call gives up when somebody stops the stage.

        Raises:
            StageAlarmError: rejected, or stopped on request.
            StageTimeoutError: no answer.
        """
        axis = self._config.axis_number if axis is None else axis
        listen = self.dialogue.heed if heeds else self.dialogue.next
        for _ in range(attempts):
            self._number = (self._number + 1) % NUMBERS
            self._send(axis, self._number, text)
            deadline_s = self._clock.now_s() + ANSWER_TIMEOUT_S
            while (reply := listen(deadline_s)) is not None:
                if isinstance(reply, Answer) and self._is_ours(reply, axis, self._number):
                    return self._taken(text, reply)
        timeout_s = attempts * ANSWER_TIMEOUT_S
        raise StageTimeoutError(
            self._device,
            f"`{text}` got no answer within {timeout_s:.1f} s{self.dialogue.noise_note()}",
            advice="check cable and supply",
            timeout_s=timeout_s,
        )

    def knows(self, text: str, *, axis: int | None = None) -> Answer | None:
        """Send a command that not every firmware knows; None where this one does not.

        Raises:
            StageAlarmError, StageTimeoutError: see `ask`.
        """
        try:
            return self.ask(text, axis=axis)
        except StageAlarmError as error:
            if error.code == "BADCOMMAND":
                return None
            raise

    def number_if_known(self, setting: str, *, axis: int | None = None) -> float | None:
        """Return a setting that is one number; None where the firmware has no such setting.

        Raises:
            StageAlarmError: the device says no number.
        """
        answer = self.knows(f"get {setting}", axis=axis)
        return None if answer is None else self._number_in(answer.data, setting)

    def number(self, setting: str, *, axis: int | None = None) -> float:
        """Return a setting that is one number.

        Raises:
            StageAlarmError: the device does not know it, or says no number.
        """
        return self._number_in(self.ask(f"get {setting}", axis=axis).data, setting)

    def _number_in(self, data: str, setting: str) -> float:
        try:
            return float(data)
        except ValueError as error:
            raise StageAlarmError(
                self._device,
                f"asked for {setting}, found {data!r} and no number",
                advice="check address and axis",
                code="BADDATA",
            ) from error

    def send_stop(self) -> None:
        """Stop the axis without waiting for the answer; from any thread."""
        self._send(self._config.axis_number, None, "stop")

    def _send(self, axis: int, number: int | None, text: str) -> None:
        self.dialogue.write(command_line(self._config.device_address, axis, number, text))

    def _is_ours(self, reply: Answer, axis: int, number: int) -> bool:
        wanted = (self._config.device_address, axis, number)
        return (reply.address, reply.axis, reply.number) == wanted

    def _taken(self, text: str, answer: Answer) -> Answer:
        if not answer.is_taken:
            raise refusal(self._device, text, answer.data)
        return answer

    def _parse(self, line: str) -> Message:
        """Where the profile counts on checksums, a message without one is damaged."""
        message = parse_message(line)
        is_bare = isinstance(message, Answer | Alert) and not message.has_checksum
        return Noise(line) if is_bare and self._config.replies_with_checksum else message

    def _not_found(self) -> DeviceNotFoundError | ConfigError:
        """Say who answers instead, if anybody does."""
        address = self._config.device_address
        there = sorted(self._call_all())
        if address in there:
            return ConfigError(
                f"{self._device}: device {address} answers without checksums",
                advice=f"send "
                f"`/{address} set comm.checksum 1`, or set replies_with_checksum = false",
            )
        if not there and (binary := binary_devices(self._line)):
            return DeviceNotFoundError(
                self._device,
                f"asked for Zaber device {address} in the ASCII protocol, found device "
                f"{', '.join(map(str, binary))} in the binary one at {BINARY_BAUD} baud",
                advice="switch it to ASCII at 115200 baud with Zaber Launcher (binary command "
                "124); devices with firmware below 6 speak the binary protocol only",
            )
        others = f"devices {', '.join(map(str, there))} answered" if there else "nothing answered"
        return DeviceNotFoundError(
            self._device,
            f"asked for Zaber device {address}, {others}{self.dialogue.noise_note()}",
            advice="check port, baud rate, device_address and the supply",
        )

    def _call_all(self) -> Iterator[int]:
        self.dialogue.write(command_line(0, WHOLE_DEVICE, None, ""))
        deadline_s = self._clock.now_s() + ANSWER_TIMEOUT_S
        while (reply := self.dialogue.heed(deadline_s)) is not None:
            text = reply.text if isinstance(reply, Noise) else ""
            message = parse_message(text) if text else reply
            if isinstance(message, Answer):
                yield message.address
