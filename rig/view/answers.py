"""What a request over HTTP is answered: the page, its icon, a socket that opens, or a refusal."""

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from rig.view.access import FAVICON, Access, Refused
from rig.view.address import peer
from rig.view.notices import Notices
from rig.view.page_file import icon, page

SOCKET = "live"
"""Place of the websocket behind the token."""


class Answers:
    """Answers every request, after the token, the host and the origin have been looked at."""

    def __init__(self, access: Access, notices: Notices) -> None:
        self._access = access
        self._notices = notices

    def __call__(self, connection: ServerConnection, request: Request) -> Response | None:
        """Give the page, refuse, or let a websocket open (None)."""
        headers = request.headers
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if request.path == FAVICON:
            return _response(200, icon(), "image/svg+xml")
        asked = self._access.judge(
            request.path, hosts[0] if len(hosts) == 1 else None, origins[0] if origins else None
        )
        if isinstance(asked, Refused):
            self._notices.say(f"{peer(connection)}: {asked.reason}: refused")
            return _response(asked.status, b"Open the address that rig has printed.\n")
        if asked.place == SOCKET and "websocket" in map(str.lower, headers.get_all("Upgrade")):
            return None
        if asked.place == "":
            found = page()
            return _response(
                200,
                found.html,
                "text/html; charset=utf-8",
                {"Content-Security-Policy": found.policy},
            )
        return _response(404, b"There is one page here, at the address that rig has printed.\n")


def _response(
    status: int,
    body: bytes,
    kind: str = "text/plain; charset=utf-8",
    more: dict[str, str] | None = None,
) -> Response:
    headers = {
        "Content-Type": kind,
        "Content-Length": str(len(body)),
        "Connection": "close",
        "Cache-Control": "no-store",
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
        **(more or {}),
    }
    reasons = {200: "OK", 403: "Forbidden", 404: "Not Found", 421: "Misdirected Request"}
    return Response(status, reasons[status], Headers(headers), body)
