"""From a wish for a page to a page that is served: token, address, browser."""

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from rig.progress import Tell
from rig.view.actions import Actions
from rig.view.message import Message
from rig.view.notices import Notices
from rig.view.server import ViewServer

_TOKEN_BYTES = 16

M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class PageRequest:
    """A live page that a person wants to see."""

    host: str = "127.0.0.1"
    """Where it is served; only this machine reaches the default."""
    port: int = 0
    """0: any free one."""


def serve_page(
    page: PageRequest,
    tell: Tell,
    show: Callable[[str], object],
    actions: Actions[M] | None = None,
) -> ViewServer[M]:
    """Return a started server with a new token.

    Args:
        page: where it is served.
        tell: told the address, and what happens at the page, one line each.
        show: given the address, e.g. to open a browser.
        actions: what the buttons do.

    Raises:
        ConfigError: the port is taken, or the host is not this machine's.
    """
    token = secrets.token_urlsafe(_TOKEN_BYTES)
    server: ViewServer[M] = ViewServer(page.host, page.port, token, Notices(tell), actions)
    server.start()
    tell(f"rig: live page: {server.url}")
    show(server.url)
    return server
