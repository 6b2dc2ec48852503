"""The pyserial handler of `sim://` URLs; pyserial finds it by the name of this module."""

import errno
from typing import TYPE_CHECKING

from serial import PortNotOpenError, SerialBase, SerialException

from rig_sim.wire.far_end import FarEnd
from rig_sim.wire.sockets import Socket, socket_at

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

SLICE_S = 0.02
"""Longest wait at a time: another thread may write meanwhile."""
LEAST_WAIT_S = 1e-6
"""Shorter waits could be lost in rounding, and time would stand still."""


class Serial(SerialBase):
    """A serial port whose far end is a simulated firmware, on the clock of that firmware."""

    _socket: Socket | None = None
    _received: bytearray

    def open(self) -> None:
        """Take the socket; the firmware notices, as a real board does by DTR.

        Raises:
            SerialException: nothing is plugged in there, or another program has it.
        """
        if self._socket is not None:
            raise SerialException(errno.EBUSY, f"{self.name} is already open")
        socket = socket_at(self.port or "")
        if socket is None:
            raise SerialException(
                errno.ENOENT, f"could not open port {self.port}: no simulated firmware is there"
            )
        with FarEnd(), socket.lock:
            if socket.is_taken:
                raise SerialException(
                    errno.EBUSY, f"could not open port {self.port}: used by another program"
                )
            socket.firmware.port_opened()
            socket.is_taken = True
        self._received = bytearray()
        self._socket = socket
        self.is_open = True

    def close(self) -> None:
        """Give the socket back."""
        socket, self._socket = self._socket, None
        self.is_open = False
        if socket is not None:
            with FarEnd(), socket.lock:
                socket.is_taken = False

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read at once."""
        self._collect()
        return len(self._received)

    def read(self, size: int = 1, /) -> bytes:
        """Read up to `size` bytes, waiting for them until the timeout on the firmware's clock."""
        socket = self._plugged()
        clock = socket.firmware.clock
        deadline_s = None if self.timeout is None else clock.now_s() + self.timeout
        while True:
            self._collect()
            now_s = clock.now_s()
            is_late = deadline_s is not None and now_s >= deadline_s
            if len(self._received) >= size or is_late:
                data = bytes(self._received[:size])
                del self._received[:size]
                return data
            with FarEnd(), socket.lock:
                event_s = socket.firmware.next_event_s()
            times_s = [now_s + SLICE_S]
            times_s += [t for t in (event_s, deadline_s) if t is not None]
            clock.sleep_s(max(min(times_s) - now_s, LEAST_WAIT_S))

    def write(self, b: "ReadableBuffer", /) -> int:
        """Send bytes; they arrive at once."""
        socket = self._plugged()
        data = bytes(b)
        with FarEnd(), socket.lock:
            socket.firmware.receive(data)
        return len(data)

    def flush(self) -> None:
        """Nothing is ever held back."""

    def reset_input_buffer(self) -> None:
        """Drop what has arrived and was not read."""
        self._collect()
        self._received.clear()

    def reset_output_buffer(self) -> None:
        """Nothing is ever held back."""

    def _plugged(self) -> Socket:
        if self._socket is None:
            raise PortNotOpenError
        return self._socket

    def _collect(self) -> None:
        socket = self._plugged()
        with FarEnd(), socket.lock:
            self._received += socket.firmware.transmit()

    def _reconfigure_port(self) -> None:
        """Baud rate and the like make no difference to a simulated wire."""
