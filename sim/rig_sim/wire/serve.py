"""A simulated firmware on a pseudo-terminal, for any serial program; in real time."""

import os
import select
import termios
import time
import tty
from collections.abc import Callable

from rig_sim.wire.sockets import Firmware

CHUNK_BYTES = 4096
LONGEST_WAIT_S = 0.02
"""A client that opens the terminal is noticed within this time."""


def serve_on_pty(firmware: Firmware, *, on_ready: Callable[[str], None]) -> None:
    """Serve a firmware on a new pseudo-terminal until interrupted.

    The firmware notices when the terminal is opened, as a board does by DTR; only if it is opened
    again within 20 ms of being closed, that goes unnoticed.

    Args:
        firmware: the far end; its clock must be the system's.
        on_ready: called once with the path of the device to open.

    Raises:
        KeyboardInterrupt: Ctrl-C, after the terminal has been closed.
    """
    server, client = os.openpty()
    try:
        path = os.ttyname(client)
        os.close(client)
        os.set_blocking(server, False)
        on_ready(path)
        _serve(server, firmware)
    finally:
        os.close(server)


def _serve(server: int, firmware: Firmware) -> None:
    poll = select.poll()
    poll.register(server, select.POLLIN)
    has_client = False
    unsent = b""
    while True:
        events = dict(poll.poll(waiting_time_s(firmware) * 1e3)).get(server, 0)
        if events & select.POLLHUP:
            # Nobody has the other end open; without the pause this would spin.
            has_client = False
            time.sleep(LONGEST_WAIT_S)
            continue
        if not has_client:
            has_client = True
            unsent = b""
            # A terminal that echoes would send the firmware its own words as commands.
            tty.setraw(server, termios.TCSANOW)
            firmware.port_opened()
        if events & select.POLLIN:
            firmware.receive(os.read(server, CHUNK_BYTES))
        unsent += firmware.transmit()
        if unsent:
            unsent = unsent[_write(server, unsent) :]


def waiting_time_s(firmware: Firmware) -> float:
    """Return how long a server may wait for bytes before it looks at the firmware again."""
    event_s = firmware.next_event_s()
    if event_s is None:
        return LONGEST_WAIT_S
    return min(LONGEST_WAIT_S, max(0.0, event_s - firmware.clock.now_s()))


def _write(server: int, data: bytes) -> int:
    """Send what the terminal takes now; returns how much that was."""
    try:
        return os.write(server, data)
    except BlockingIOError:
        return 0
