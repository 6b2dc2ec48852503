"""Lines of text over a serial port: the one door to pyserial."""

from typing import Protocol, Self

import serial

from rig.devices import Clock
from rig.errors import DeviceLostError, DeviceNotFoundError
from rig_drivers.open_errors import not_opened
from rig_drivers.stage.serial_ports import resolve_port

LONGEST_LINE = 512
"""More bytes without an end of line are noise."""
CHUNK_BYTES = 4096
"""Most bytes taken at a time."""
SLICE_S = 0.02
"""Longest wait inside pyserial, so that the clock and other threads are looked at."""
WRITE_TIMEOUT_S = 2.0


class _Port(Protocol):
    """What is used of a pyserial port, whatever its class."""

    @property
    def baudrate(self) -> int: ...

    @baudrate.setter
    def baudrate(self, baudrate: int) -> None: ...

    @property
    def in_waiting(self) -> int: ...

    def read(self, size: int, /) -> bytes: ...

    def write(self, data: bytes, /) -> int | None: ...

    def close(self) -> None: ...


class SerialLine:
    """A serial port read line by line; every vendor exception becomes one of ours.

    Bytes may be written from any thread; only one may read.
    """

    def __init__(
        self,
        port: str,
        baud: int,
        *,
        clock: Clock,
        device: str,
        dtr: bool | None = None,
        rts: bool | None = None,
    ) -> None:
        """Describe the line without opening it.

        Args:
            port: device path, `usb-serial:NUMBER`, or a pyserial URL such as `socket://host:port`.
            baud: bits per second; 8 data bits, no parity, 1 stop bit.
            clock: on which deadlines are measured.
            device: name used in errors.
            dtr: level of the line DTR while the port is open; None: as the system has it.
            rts: the same of RTS.
        """
        self._port = port
        self._baud = baud
        self._clock = clock
        self._device = device
        self._levels = (dtr, rts)
        self._serial: _Port | None = None
        self._buffer = bytearray()
        self._is_overlong = False
        self._noise_bytes = 0

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def is_open(self) -> bool:
        """Whether the port is held."""
        return self._serial is not None

    @property
    def noise_bytes(self) -> int:
        """How many bytes were thrown away since opening because they formed no line of text."""
        return self._noise_bytes

    def open(self) -> None:
        """Take the port for this program alone.

        Raises:
            DeviceNotFoundError: it is not there, in use, or not permitted.
        """
        port = resolve_port(self._port, device=self._device)
        try:
            opened = serial.serial_for_url(
                port,
                do_not_open=True,
                baudrate=self._baud,
                timeout=SLICE_S,
                write_timeout=WRITE_TIMEOUT_S,
                exclusive=True,
            )
            # Before it opens: a level that is set later is a pulse, which resets many boards.
            dtr, rts = self._levels
            if dtr is not None:
                opened.dtr = dtr
            if rts is not None:
                opened.rts = rts
            opened.open()
            self._serial = opened
        except (OSError, ValueError) as error:
            raise self._not_opened(error) from error
        self._buffer.clear()
        self._is_overlong = False
        self._noise_bytes = 0

    def close(self) -> None:
        """Give the port back; safe at any time, also when the device is gone."""
        port, self._serial = self._serial, None
        if port is not None:
            try:
                port.close()
            except OSError as error:
                raise self._lost(error) from error

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            DeviceLostError: the port is closed, gone, or takes no more data.
        """
        port = self._opened()
        try:
            port.write(data)
        except OSError as error:
            raise self._lost(error) from error

    def probe(self, data: bytes, *, baud: int, timeout_s: float) -> bytes:
        """Send bytes at another speed, and return all that comes back within `timeout_s`.

        Raises:
            DeviceLostError: the port is closed, gone, or takes no more data.
        """
        port = self._opened()
        deadline_s = self._clock.now_s() + timeout_s
        try:
            port.baudrate = baud
            self._buffer.clear()
            port.write(data)
            while self._clock.now_s() < deadline_s:
                self._fill(waits=True)
            port.baudrate = self._baud
        except (OSError, ValueError) as error:
            raise self._lost(error) from error
        answer = bytes(self._buffer)
        self._buffer.clear()
        return answer

    def read_line(self, timeout_s: float) -> str | None:
        """Return the next line without its end, None if none is complete in time.

        Empty lines are skipped. Bytes that are not ASCII come as U+FFFD.

        Raises:
            DeviceLostError: the port is closed or gone.
        """
        deadline_s = self._clock.now_s() + timeout_s
        while True:
            line = self._take_line()
            if line is not None:
                return line
            is_late = self._clock.now_s() >= deadline_s
            if not self._fill(waits=not is_late) and is_late:
                return None

    def _take_line(self) -> str | None:
        """Return the first non-empty line of the buffer."""
        while (end := self._buffer.find(b"\n")) >= 0:
            raw = bytes(self._buffer[:end])
            del self._buffer[: end + 1]
            is_noise = self._is_overlong or len(raw) > LONGEST_LINE
            self._is_overlong = False
            text = raw.decode("ascii", errors="replace").strip("\r")
            self._noise_bytes += len(raw) if is_noise else text.count("\ufffd")
            if text and not is_noise:
                return text
        if len(self._buffer) > LONGEST_LINE:
            self._is_overlong = True
            self._noise_bytes += len(self._buffer)
            self._buffer.clear()
        return None

    def _fill(self, *, waits: bool) -> bool:
        """Move what has arrived into the buffer; returns whether anything had."""
        port = self._opened()
        try:
            waiting = port.in_waiting
            data = port.read(min(max(1, waiting), CHUNK_BYTES)) if waiting or waits else b""
        except (OSError, TypeError) as error:
            # TypeError is what pyserial makes of a port that another thread closes meanwhile.
            raise self._lost(error) from error
        self._buffer += data
        return bool(data)

    def _opened(self) -> _Port:
        if self._serial is None:
            raise DeviceLostError(
                self._device,
                f"port {self._port} is not open",
                advice="use the device inside `with`",
            )
        return self._serial

    def _lost(self, error: Exception) -> DeviceLostError:
        return DeviceLostError(
            self._device,
            f"port {self._port} does not answer any more ({error})",
            advice="check cable and power, then open it again",
        )

    def _not_opened(self, error: Exception) -> DeviceNotFoundError:
        port = f"port {self._port}"
        absent = (f"no {port}", "check cable and name (`rig devices` lists ports)")
        return not_opened(error, self._device, what=port, absent=absent, group="dialout")
