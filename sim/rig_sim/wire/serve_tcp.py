"""A simulated firmware on a TCP port of this machine, for programs that take no serial device."""

import select
import socket
from collections.abc import Callable

from rig_sim.wire.serve import CHUNK_BYTES, waiting_time_s
from rig_sim.wire.sockets import Firmware

LOOPBACK = "127.0.0.1"


def serve_on_tcp(firmware: Firmware, port: int, *, on_ready: Callable[[str], None]) -> None:
    """Serve a firmware to one program at a time until interrupted.

    Connecting opens the port of the controller, as on a pseudo-terminal.

    Args:
        firmware: the far end; its clock must be the system's.
        port: TCP port on the loopback interface; 0 takes a free one.
        on_ready: called once with the pyserial URL to open.

    Raises:
        OSError: the port is taken.
        KeyboardInterrupt: Ctrl-C, after the port has been closed.
    """
    with socket.create_server((LOOPBACK, port)) as server:
        on_ready(f"socket://{LOOPBACK}:{server.getsockname()[1]}")
        while True:
            client, _ = server.accept()
            with client:
                firmware.port_opened()
                try:
                    _talk(client, firmware)
                except ConnectionError:
                    continue  # the program has gone; the next one may come


def _talk(client: socket.socket, firmware: Firmware) -> None:
    """Pass bytes both ways until the program hangs up."""
    while True:
        readable, _, _ = select.select([client], [], [], waiting_time_s(firmware))
        if readable:
            data = client.recv(CHUNK_BYTES)
            if not data:
                return
            firmware.receive(data)
        answer = firmware.transmit()
        if answer:
            client.sendall(answer)
