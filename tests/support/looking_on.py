"""A page that looks on while a verb runs, in the browser's place."""

import json
import threading
from contextlib import suppress
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from rig.view.wire import decode

SOON_S = 30.0


class LookingOn(threading.Thread):
    """Looks at the first page whose address is told, and keeps what it saw."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.address: list[str] = []
        self.known = threading.Event()
        self.is_open = threading.Event()
        self.headers: list[dict[str, Any]] = []
        self.state: dict[str, Any] = {}

    def run(self) -> None:
        self.known.wait(SOON_S)
        url = self.address[0].replace("http", "ws") + "live"
        with suppress(ConnectionClosed), connect(url, max_size=None, compression=None) as page:
            self.is_open.set()
            for message in page:
                if isinstance(message, str):
                    self.state.update(json.loads(message))
                else:
                    header, _ = decode(message)
                    self.headers.append(header)
                    page.send(json.dumps({"ack": header["number"]}))


def looking_on(monkeypatch: pytest.MonkeyPatch) -> LookingOn:
    """Return a started page that opens the address that a browser would be given."""
    one = LookingOn()

    def open_browser(url: str) -> bool:
        one.address.append(url)
        one.known.set()
        return one.is_open.wait(SOON_S)

    monkeypatch.setattr("rig.view.browser.open_browser", open_browser)
    one.start()
    return one
