"""What the library would tell of a connection in its own words, told in one line of ours."""

import logging

from websockets.asyncio.server import ServerConnection

from rig.view.address import peer
from rig.view.notices import Notices


def visit(notices: Notices) -> type[ServerConnection]:
    """Return the connections of a server that says which of them asked for nothing."""

    class Visit(ServerConnection):
        def connection_lost(self, exc: Exception | None) -> None:
            super().connection_lost(exc)
            if self.request is None:
                notices.say(f"{peer(self)}: asked for nothing that is a page: closed")

    return Visit


class _OneLine(logging.Handler):
    """Says in one line what the library would print as a traceback."""

    def __init__(self, notices: Notices) -> None:
        super().__init__(logging.ERROR)
        self._notices = notices

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        self._notices.say(f"{record.getMessage()}: {error!r}")


def in_one_line(notices: Notices) -> logging.Logger:
    """Return a logger for the library that says one line per trouble."""
    logger = logging.Logger("rig.view", logging.ERROR)  # noqa: LOG001 - not part of the tree
    logger.addHandler(_OneLine(notices))
    return logger
