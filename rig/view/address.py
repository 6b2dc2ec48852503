"""Where the live page is served: the socket that listens, and the names of both ends."""

import os
import socket
from typing import Any

from websockets.asyncio.server import ServerConnection

from rig.errors import ConfigError

_ELSEWHERE = ("192.0.2.1", 9)
"""An address of no machine, kept free for documentation (RFC 5737)."""


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens at a name or an address of this machine.

    Raises:
        ConfigError: the port is taken, or the host is not this machine's.
    """
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        return socket.create_server((host, port), family=family)
    except OSError as error:
        # Names that are not found have numbers of their own, below 0, and a text.
        number = error.errno or 0
        why = os.strerror(number) if number > 0 else error.strerror
        raise ConfigError(
            f"live page at {host}, port {port}: cannot listen there: {why}",
            advice="choose another --view-port (0: any free one) or another --view-host",
        ) from error


def own_address() -> str:
    """Return the address by which others reach this machine; its name where it has no network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ELSEWHERE)  # nothing is sent: only the way out is looked up
            return str(probe.getsockname()[0])
        except OSError:
            return socket.gethostname()


def peer(connection: ServerConnection) -> str:
    """Return the address of who has connected."""
    address: Any = connection.remote_address
    return "somebody" if not address else str(address[0])
