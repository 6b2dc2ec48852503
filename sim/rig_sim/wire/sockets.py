"""Where simulated firmware is plugged in, so that pyserial finds it by URL."""

import threading
from collections.abc import Generator
from contextlib import contextmanager
from typing import Protocol

import serial

from rig.devices import Clock
from rig.errors import ConfigError

HANDLER_PACKAGE = "rig_sim.wire"
"""Where pyserial looks for `protocol_sim`."""


class Firmware(Protocol):
    """The far end of a serial line; nothing in it runs by itself."""

    @property
    def clock(self) -> Clock:
        """The clock on which it lives."""
        ...

    def receive(self, data: bytes) -> None:
        """Take bytes from the wire."""
        ...

    def transmit(self) -> bytes:
        """Hand over the bytes printed since the last call."""
        ...

    def next_event_s(self) -> float | None:
        """Return when something will happen by itself; None if nothing will."""
        ...

    def port_opened(self) -> None:
        """Take note that a program has opened the port; many boards reset on it (DTR)."""
        ...

    def hard_reset(self) -> None:
        """Start again with fresh power."""
        ...

    def trip(self) -> None:
        """Let go wrong what this kind of controller answers with an alarm."""
        ...

    def lie(self, reports: int) -> None:
        """Claim in the next reports that the board has arrived, wherever it is."""
        ...


class Socket:
    """One port of the simulated machine: a firmware behind it, at most one program before it."""

    def __init__(self, firmware: Firmware) -> None:
        self.firmware = firmware
        self.lock = threading.RLock()
        self.is_taken = False


_sockets: dict[str, Socket] = {}


@contextmanager
def plug(url: str, firmware: Firmware) -> Generator[None]:
    """Make a firmware reachable by `serial.serial_for_url(url)` while the context lasts.

    Args:
        url: such as `sim://grbl`; upper and lower case are the same.
        firmware: the far end.

    Raises:
        ConfigError: the URL is of another scheme, or already in use.
    """
    key = url.lower()
    if not key.startswith("sim://"):
        raise ConfigError(f"{url}: is no simulated port", advice="give a URL such as sim://grbl")
    if key in _sockets:
        raise ConfigError(
            f"{url}: a simulated firmware is already plugged in", advice="use another name"
        )
    if HANDLER_PACKAGE not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(HANDLER_PACKAGE)
    _sockets[key] = Socket(firmware)
    try:
        yield
    finally:
        del _sockets[key]


def socket_at(url: str) -> Socket | None:
    """Return what is plugged in at `url`."""
    return _sockets.get(url.lower())
