"""The server of the live page: who gets in, who gets what, and that bad clients change nothing."""

import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, suppress
from http.client import HTTPConnection

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from rig.errors import ConfigError, StoreError
from rig.view.actions import Actions, Recording, Refusal
from rig.view.client import IN_FLIGHT
from rig.view.message import PlainMessage
from rig.view.notices import Notices
from rig.view.server import MOST_PAGES, ViewServer
from rig.view.wire import decode

TOKEN = "right"  # noqa: S105
SOON_S = 20.0
Server = ViewServer[PlainMessage]


class Told:
    """Lines that were told, and a way to wait for one."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._news = threading.Condition()

    def __call__(self, text: str) -> None:
        with self._news:
            self.lines.append(text)
            self._news.notify_all()

    def has(self, part: str) -> bool:
        with self._news:
            return self._news.wait_for(lambda: any(part in one for one in self.lines), SOON_S)


@pytest.fixture
def told() -> Told:
    return Told()


@pytest.fixture
def server(told: Told) -> Iterator[Server]:
    with closing(ViewServer[PlainMessage]("127.0.0.1", 0, TOKEN, Notices(told))) as one:
        yield one.start()


def look(server: Server, token: str = TOKEN, **options: object) -> ClientConnection:
    url = f"ws://127.0.0.1:{server.port}/{token}/live"
    return connect(url, max_size=None, compression=None, **options)  # type: ignore[arg-type]


def words(page: ClientConnection) -> dict[str, object]:
    text = page.recv(SOON_S)
    assert isinstance(text, str)
    return json.loads(text)


def words_among_frames(page: ClientConnection) -> dict[str, object]:
    while not isinstance(text := page.recv(SOON_S), str):
        pass
    return json.loads(text)


def frame(page: ClientConnection) -> int:
    """Number of the next message that is no text."""
    while isinstance(message := page.recv(SOON_S), str):
        pass
    header, _ = decode(message)
    return header["number"]


def say(page: ClientConnection, **command: object) -> None:
    page.send(json.dumps(command))


def publish(server: Server, count: int = 1) -> None:
    for _ in range(count):
        server.publish(PlainMessage("capture", {}, {"x": np.zeros(100_000, np.uint8)}))


def ask(server: Server, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    connection = HTTPConnection("127.0.0.1", server.port, timeout=SOON_S)
    with closing(connection):
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read(), dict(answer.headers)


def test_the_page_is_given_with_its_seal(server: Server):
    status, body, headers = ask(server, f"/{TOKEN}/")
    assert status == 200
    assert body.startswith(b"<!doctype html>")
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert headers["Content-Security-Policy"].startswith("default-src 'none'")
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cache-Control"] == "no-store"
    assert server.url == f"http://127.0.0.1:{server.port}/{TOKEN}/"


def test_the_icon_needs_no_token(server: Server):
    status, body, headers = ask(server, "/favicon.ico")
    assert (status, headers["Content-Type"]) == (200, "image/svg+xml")
    assert body.startswith(b"<svg")


@pytest.mark.parametrize(
    ("path", "headers", "status", "part"),
    [
        ("/", {}, 403, "wrong token"),
        ("/wrong/", {}, 403, "wrong token"),
        (f"/{TOKEN}/", {"Host": "evil.example"}, 421, "evil.example"),
        (f"/{TOKEN}/", {"Origin": "http://evil.example"}, 403, "evil.example"),
    ],
)
def test_others_are_refused_and_told_in_one_line(
    server: Server, told: Told, path: str, headers: dict[str, str], status: int, part: str
):
    found, body, _ = ask(server, path, **headers)
    assert found == status
    assert b"the address that rig has printed" in body
    assert told.has(part)
    assert len(told.lines) == 1
    assert told.lines[0].startswith("view: 127.0.0.1: ")
    assert told.lines[0].endswith(": refused")


def test_there_is_one_page(server: Server):
    assert ask(server, f"/{TOKEN}/other")[0] == 404
    assert ask(server, f"/{TOKEN}/live")[0] == 404


def test_a_socket_with_a_wrong_token_or_of_another_page_does_not_open(server: Server, told: Told):
    for options in ({"token": "wrong"}, {"origin": "http://evil.example"}):
        with pytest.raises(InvalidStatus) as refused, look(server, **options):
            pass
        assert refused.value.response.status_code == 403
    assert told.has("wrong token")
    assert server.pages == 0


def test_the_newest_comes_at_once_and_two_are_on_their_way(server: Server):
    publish(server, 3)
    with look(server) as page:
        assert words(page)["recording"] is False
        assert frame(page) == 2
        publish(server)
        assert frame(page) == 3
        publish(server, 5)
        say(page, ack=2)
        assert frame(page) == 8, "newest wins"
        say(page, ack=3)
        publish(server)
        assert frame(page) == 9


def test_a_stalled_page_gets_two_then_the_newest_and_the_other_all(server: Server):
    with look(server) as stalled, look(server) as page:
        words(stalled)
        for number in range(12):
            publish(server)
            assert frame(page) == number
            say(page, ack=number)
        first, second = frame(stalled), frame(stalled)
        assert first < second < 11
        say(stalled, ack=second)
        assert frame(stalled) == 11, "nothing but the newest came after the two"


def test_a_killed_page_changes_nothing(server: Server, told: Told):
    publish(server)
    with look(server) as page:
        with look(server) as killed:
            assert frame(killed) == 0
            killed.socket.shutdown(socket.SHUT_RDWR)
        assert frame(page) == 0
        for number in (1, 2, 3):
            say(page, ack=number - 1)
            publish(server)
            assert frame(page) == number
        assert told.has("page closed by 127.0.0.1")


@pytest.mark.parametrize(
    ("rubbish", "code", "part"),
    [
        ("hello", 1008, "no command of the live page"),
        (b"\x00\xff", 1008, "no command of the live page"),
        ('{"do": "format"}', 1008, "do: Input should be"),
        ("x" * 5000, 1009, "sent more than 2048 bytes: closed"),
    ],
    ids=["a word", "bytes", "no such command", "too much"],
)
def test_rubbish_closes_its_page_alone(
    server: Server, told: Told, rubbish: str | bytes, code: int, part: str
):
    with look(server) as page, look(server) as other:
        words(page)
        page.send(rubbish)
        with pytest.raises(ConnectionClosed):
            page.recv(SOON_S)
        assert page.close_code == code
        assert told.has(part)
        publish(server)
        assert frame(other) == 0


def test_what_is_no_request_is_one_line(server: Server, told: Told):
    with closing(socket.create_connection(("127.0.0.1", server.port))) as line:
        line.sendall(b"\x16\x03\x01 rubbish\r\n\r\n")
        line.settimeout(SOON_S)
        while line.recv(1000):
            pass
    assert told.has("view: 127.0.0.1: asked for nothing that is a page: closed")
    assert ask(server, f"/{TOKEN}/")[0] == 200


def test_who_says_nothing_keeps_nobody_from_looking(server: Server, told: Told):
    with closing(socket.create_connection(("127.0.0.1", server.port))):
        publish(server)
        with look(server) as page:
            assert frame(page) == 0
            assert server.pages == 1
    assert told.has("asked for nothing that is a page")


def test_one_page_too_many_is_refused(server: Server, told: Told):
    with ExitStack() as pages:
        for _ in range(MOST_PAGES):
            words(pages.enter_context(look(server)))
        late = pages.enter_context(look(server))
        with pytest.raises(ConnectionClosed):
            late.recv(SOON_S)
        assert (late.close_code, late.close_reason) == (1013, "8 pages are open already")
    assert told.has("8 pages are open: one more is refused")


def test_pages_are_told_that_the_run_has_ended(told: Told):
    server = ViewServer[PlainMessage]("127.0.0.1", 0, TOKEN, Notices(told)).start()
    with look(server) as page, look(server) as stalled:
        words(page)
        words(stalled)
        publish(server)
        threads = [one for one in threading.enumerate() if one.name == "rig view"]
        assert len(threads) == 1
        server.close()
        with suppress(ConnectionClosed):
            while page.recv(SOON_S):
                pass
        assert (page.close_code, page.close_reason) == (1001, "the run has ended")
        assert not threads[0].is_alive()
    server.close()
    publish(server)
    assert server.pages == 0


def test_the_last_message_comes_before_the_end(told: Told):
    for _ in range(5):
        server = ViewServer[PlainMessage]("127.0.0.1", 0, TOKEN, Notices(told)).start()
        with look(server) as page:
            words(page)
            publish(server, IN_FLIGHT)  # so many come without a word of the page
            server.close()
            numbers: list[int] = []
            with suppress(ConnectionClosed):
                while True:
                    numbers.append(frame(page))
            assert numbers[-1] == IN_FLIGHT - 1


def test_a_taken_port_is_refused_and_told(server: Server):
    with pytest.raises(ConfigError, match=f"port {server.port}: cannot listen there: .*in use"):
        ViewServer[PlainMessage]("127.0.0.1", server.port, TOKEN, Notices(print))
    with pytest.raises(ConfigError, match=r"no\.such\.host\.invalid") as error:
        ViewServer[PlainMessage]("no.such.host.invalid", 0, TOKEN, Notices(print))
    assert "--view-host" in error.value.advice


def test_for_other_machines_the_address_is_one_that_they_reach(told: Told):
    everywhere = "0.0.0.0"  # noqa: S104
    with closing(ViewServer[PlainMessage](everywhere, 0, TOKEN, Notices(told)).start()) as server:
        host = server.url.removeprefix("http://").partition(":")[0]
        assert host not in ("", everywhere)
        assert server.url == f"http://{host}:{server.port}/{TOKEN}/"
        assert ask(server, f"/{TOKEN}/", Host=f"{host}:{server.port}")[0] == 200


class Counted:
    """A message that counts how often it was encoded, and for whom."""

    def __init__(self) -> None:
        self.wanted: list[frozenset[str]] = []

    def encoded(self, number: int, wants: frozenset[str]) -> bytes:
        self.wanted.append(wants)
        return PlainMessage("capture", {}).encoded(number, wants)


def test_pages_that_want_the_same_share_one_encoding(told: Told):
    with closing(ViewServer[Counted]("127.0.0.1", 0, TOKEN, Notices(told)).start()) as server:
        messages = [Counted(), Counted()]
        server.publish(messages[0])
        with look(server) as one, look(server) as two:  # type: ignore[arg-type]
            assert (frame(one), frame(two)) == (0, 0)
            assert messages[0].wanted == [frozenset({"views", "sigma", "label"})]
            say(one, want=["slope"])
            assert frame(one) == 0, "the newest again, with what is new"
            say(one, ack=0)
            server.publish(messages[1])
            assert (frame(one), frame(two)) == (1, 1)
        assert sorted(messages[1].wanted, key=len) == [
            frozenset({"slope"}),
            frozenset({"views", "sigma", "label"}),
        ]


def test_nothing_is_encoded_while_nobody_looks(told: Told):
    with closing(ViewServer[Counted]("127.0.0.1", 0, TOKEN, Notices(told)).start()) as server:
        unseen = Counted()
        server.publish(unseen)
        server.publish(Counted())
        with look(server) as page:  # type: ignore[arg-type]
            assert frame(page) == 1
        assert unseen.wanted == []


def serving(told: Told, actions: Actions[PlainMessage]) -> "closing[Server]":
    return closing(ViewServer("127.0.0.1", 0, TOKEN, Notices(told), actions).start())


def answer(page: ClientConnection) -> dict[str, object]:
    while "answer" not in (found := words_among_frames(page)):
        pass
    return found


def test_buttons_do_what_the_run_lets_them_and_all_pages_hear_of_it(told: Told):
    saved: list[object] = []
    is_on = [False]

    def switch(to: bool, text: str) -> Callable[[], str]:
        def switched() -> str:
            is_on[0] = to
            return text

        return switched

    def save(message: PlainMessage) -> str:
        saved.append(message.header["n"])
        return "saved it"

    recording = Recording(switch(True, "recording"), switch(False, "ended"), lambda: is_on[0])
    with serving(told, Actions(save, recording)) as server, look(server) as page:
        assert words(page) == {"save": None, "record": None, "recording": False}
        say(page, do="save")
        assert answer(page)["answer"] == "nothing has been shown yet"
        for n in (10, 11):
            server.publish(PlainMessage("capture", {"n": n}))
            number = frame(page)
        say(page, ack=number - 1)
        say(page, do="save")
        assert answer(page) == {"answer": "saved it", "done": True, "do": "save"}
        assert saved == [10], "what is shown, not what is newest"
        with look(server) as other:
            words(other)
            say(page, do="record")
            assert answer(page)["answer"] == "recording"
            assert words(page)["recording"] is True
            assert words_among_frames(other)["recording"] is True
            say(other, do="stop")
            assert answer(other)["answer"] == "ended"
        assert is_on == [False]


def test_a_button_that_cannot_says_why(told: Told):
    def fail(_message: PlainMessage) -> str:
        raise StoreError("disk full", advice="make room")

    actions = Actions(fail, Refusal("recorded already"))
    with serving(told, actions) as server, look(server) as page:
        assert words(page)["record"] == "recorded already"
        publish(server)
        say(page, ack=frame(page))
        say(page, do="save")
        assert answer(page) == {"answer": "disk full; make room", "done": False, "do": "save"}
        assert told.has("view: disk full; make room")
        say(page, do="stop")
        assert answer(page)["answer"] == "recorded already"
        publish(server)
        assert frame(page) == 1, "the run goes on"


def test_how_the_link_is_comes_with_what_was_drawn(server: Server):
    with look(server) as page:
        words(page)
        publish(server)
        say(page, ack=frame(page))
        link = words(page)
        assert link["pages"] == 1
        assert link["skipped"] == 0
        assert isinstance(link["age_ms"], float)
        assert 0.0 <= link["age_ms"] < 1e3 * SOON_S


def test_a_page_that_reads_nothing_does_not_hold_the_end_up(told: Told):
    server = ViewServer[PlainMessage]("127.0.0.1", 0, TOKEN, Notices(told)).start()
    (thread,) = [one for one in threading.enumerate() if one.name == "rig view"]
    with closing(socket.create_connection(("127.0.0.1", server.port))) as line:
        line.sendall(
            f"GET /{TOKEN}/live HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
        )
        assert told.has("page opened by 127.0.0.1")
        server.publish(PlainMessage("capture", {}, {"x": np.zeros(30_000_000, np.uint8)}))
        server.close()
        assert not thread.is_alive()
