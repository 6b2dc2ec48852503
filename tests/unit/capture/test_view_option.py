"""`rig capture --view`, from the command line to a page."""

import json
import re
import socket
import threading
from contextlib import closing, suppress
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from rig.testing.simulated import PROFILE
from rig.view.wire import decode
from tests.support.command import Command

SOON_S = 30.0


class Page(threading.Thread):
    """Looks at the first page whose address is told, and keeps what it saw."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.address: list[str] = []
        self.known = threading.Event()
        self.is_open = threading.Event()
        self.headers: list[dict[str, object]] = []
        self.state: dict[str, object] = {}

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


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> Page:
    """Takes the browser's place."""
    one = Page()

    def open_browser(url: str) -> bool:
        one.address.append(url)
        one.known.set()
        return one.is_open.wait(SOON_S)

    monkeypatch.setattr("rig.view.browser.open_browser", open_browser)
    one.start()
    return one


@pytest.mark.slow
def test_a_page_sees_the_capture(rig: Command, page: Page, tmp_path: Path):
    out = tmp_path / "out"
    done = rig(
        "capture", str(PROFILE), "--slopes-only", "--view", "--frames", "5", "--out", str(out)
    )
    page.join(SOON_S)
    assert done.code == 0, done.err
    assert not page.is_alive()
    told = re.findall(r"^rig: live page: (\S+)$", done.err, re.MULTILINE)
    assert told == page.address
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{22}/", told[0])
    assert len(page.headers) > 0
    assert page.headers[-1]["unit"] == "px"
    assert page.headers[-1]["rig"] == "simulated-rig"
    assert page.state["save"] == f"every frame is written into {out} already"
    assert page.state["record"] is None


def test_a_taken_port_is_one_line_and_nothing_is_captured(rig: Command, tmp_path: Path):
    with closing(socket.create_server(("127.0.0.1", 0))) as taken:
        port = taken.getsockname()[1]
        done = rig(
            "capture", str(PROFILE), "--slopes-only", "--view", "--view-port", str(port),
            "--frames", "1", "--out", str(tmp_path / "out"),
        )  # fmt: skip
    assert done.code == 1
    assert done.err.count("\n") == 1
    assert f"port {port}: cannot listen there: Address already in use" in done.err
    assert not (tmp_path / "out").exists()


def test_where_belongs_to_view(rig: Command):
    done = rig("capture", str(PROFILE), "--slopes-only", "--view-port", "8000", "--frames", "1")
    assert done.code == 2
    assert "--view-host and --view-port belong to --view" in done.err
