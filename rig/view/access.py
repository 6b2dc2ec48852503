"""Who may look: whoever has the token, from a page that this server gave."""

import hmac
import ipaddress
import socket
from dataclasses import dataclass
from urllib.parse import urlsplit

FAVICON = "/favicon.ico"


@dataclass(frozen=True, slots=True)
class Asked:
    """What a request names: the part of its path behind the token."""

    place: str


@dataclass(frozen=True, slots=True)
class Refused:
    """Why a request is refused."""

    status: int
    reason: str


@dataclass(frozen=True, slots=True)
class Access:
    """Judges requests by path, `Host` and `Origin`.

    A name in `Host` that is not this machine's is how a foreign page reaches a server on loopback
    (DNS rebinding); `Origin` tells a page that another server gave. Both are refused, even with
    the right token. An address in figures cannot be rebound.
    """

    token: str
    host: str
    """The name or address that the server was told to listen at."""

    def judge(self, path: str, host: str | None, origin: str | None) -> Asked | Refused:
        """Return what is asked for, or why nothing is given.

        Args:
            path: of the request, with query.
            host: header of that name; None where it is missing.
            origin: header of that name; None where it is missing, as with every other program.
        """
        if host is None or not self._is_ours(host):
            return Refused(421, f"called by the name {_quoted(host)}, which is not this machine's")
        if origin is not None and not _is_same(origin, host):
            return Refused(403, f"asked by a page of {_quoted(origin)}")
        token, _, place = path.partition("?")[0].removeprefix("/").partition("/")
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            return Refused(403, "asked with a wrong token or none")
        return Asked(place)

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        return name in {"localhost", self.host.lower(), *_own_names()} or _is_address(name)


def _own_names() -> tuple[str, str]:
    own = socket.gethostname().lower()
    return own, f"{own}.local"


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_same(origin: str, host: str) -> bool:
    return origin.lower() in {f"http://{host.lower()}", f"https://{host.lower()}"}


def _quoted(text: str | None) -> str:
    return "(none)" if text is None else repr(text[:60])
