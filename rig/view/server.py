"""A small server for one page: HTTP for the page itself, a websocket for what it shows.

One thread of its own. Whoever publishes hands one reference over and goes on; what is sent to whom
is settled here, page by page: the newest message, at most two on their way, acknowledged once they
are drawn. A page that stalls, dies or talks rubbish costs the others and the run nothing.
"""

import asyncio
import json
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Generic, Self, TypeVar

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode

from rig.errors import FormatError, RigError
from rig.view.access import Access
from rig.view.actions import Actions, Refusal
from rig.view.address import listen, own_address, peer
from rig.view.answers import Answers
from rig.view.client import Client, Sent
from rig.view.commands import MOST_BYTES, Command, parse
from rig.view.connection import in_one_line, visit
from rig.view.message import Message
from rig.view.notices import Notices

MOST_PAGES = 8
_OPEN_S, _CLOSE_S, _PING_S, _LINK_EVERY_S = 5.0, 10.0, 20.0, 0.5
_LOOK_S, _SHUT_S, _JOIN_S = 0.01, 1.0, 2.5
"""Within which all pages are let go of, and the thread ends: whatever they do."""

M = TypeVar("M", bound=Message)


class ViewServer(Generic[M]):
    """Serves the live page from a thread of its own; `start` it, `close` it.

    Args:
        host: where to listen: a name or an address of this machine.
        port: 0 for any free one.
        token: what the path of every request must begin with.
        notices: told what happens, one line each.
        actions: what the buttons do.

    Raises:
        ConfigError: the port is taken, or the host is not this machine's.
    """

    def __init__(
        self,
        host: str,
        port: int,
        token: str,
        notices: Notices,
        actions: Actions[M] | None = None,
    ) -> None:
        self._socket = listen(host, port)
        self._host = host
        self._access = Access(token, host)
        self._notices = notices
        self._actions: Actions[M] = Actions() if actions is None else actions
        self._clients: dict[ServerConnection, Client[M]] = {}
        self._newest: Sent[M] | None = None
        self._count = 0
        self._encoded: dict[frozenset[str], tuple[int, bytes]] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._over: asyncio.Event | None = None
        self._is_running = threading.Event()
        self._thread = threading.Thread(target=self._run, name="rig view", daemon=True)

    @property
    def url(self) -> str:
        """The address to open, token and all."""
        name = self._host
        if name in {"0.0.0.0", "::"}:  # noqa: S104 - compared, not listened at
            name = own_address()
        shown = f"[{name}]" if ":" in name else name
        return f"http://{shown}:{self.port}/{self._access.token}/"

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._socket.getsockname()[1])

    @property
    def pages(self) -> int:
        """How many look on."""
        return len(self._clients)

    def start(self) -> Self:
        """Begin to serve."""
        self._thread.start()
        self._is_running.wait()
        return self

    def publish(self, message: M) -> None:
        """Make this the newest message; from any one thread, at the cost of a reference."""
        self._newest = Sent(self._count, message, time.monotonic())
        self._count += 1
        if self._clients and self._loop is not None:
            with suppress(RuntimeError):  # closed meanwhile
                self._loop.call_soon_threadsafe(self._wake)

    def close(self) -> None:
        """Tell all pages that the run has ended, and stop; any number of times."""
        if self._loop is not None and self._over is not None:
            with suppress(RuntimeError):  # closed before
                self._loop.call_soon_threadsafe(self._over.set)
        if self._thread.is_alive():
            self._thread.join(_JOIN_S)
        self._socket.close()

    def _run(self) -> None:
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._loop, self._over = asyncio.get_running_loop(), asyncio.Event()
        server = await serve(
            self._page_came,
            sock=self._socket,
            process_request=Answers(self._access, self._notices),
            compression=None,
            max_size=MOST_BYTES,
            open_timeout=_OPEN_S,
            close_timeout=_CLOSE_S,
            ping_interval=_PING_S,
            ping_timeout=_PING_S,
            server_header=None,
            logger=in_one_line(self._notices),
            create_connection=visit(self._notices),
        )
        self._is_running.set()
        await self._over.wait()
        await self._shut(server)

    async def _shut(self, server: Server) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._last_word(), _SHUT_S)
        server.close(code=CloseCode.GOING_AWAY, reason="the run has ended")
        with suppress(TimeoutError):
            await asyncio.wait_for(server.wait_closed(), _SHUT_S)
        for connection in self._clients:
            connection.transport.abort()

    async def _last_word(self) -> None:
        """Wait until every page that keeps up has been sent the newest message."""
        newest = self._newest
        while newest is not None and any(
            client.has_credit and client.last < newest.number for client in self._clients.values()
        ):
            self._wake()
            await asyncio.sleep(_LOOK_S)

    async def _page_came(self, connection: ServerConnection) -> None:
        visitor = peer(connection)
        if len(self._clients) >= MOST_PAGES:
            self._notices.say(f"{visitor}: {MOST_PAGES} pages are open: one more is refused")
            await connection.close(
                CloseCode.TRY_AGAIN_LATER, f"{MOST_PAGES} pages are open already"
            )
            return
        client: Client[M] = Client(visitor)
        self._clients[connection] = client
        self._notices.say(f"page opened by {visitor}")
        sending = asyncio.create_task(self._send_newest(connection, client))
        try:
            await connection.send(self._state())
            await self._listen_to(connection, client)
        except ConnectionClosed as closed:
            if closed.sent is not None and closed.sent.code == CloseCode.MESSAGE_TOO_BIG:
                self._notices.say(f"{visitor}: sent more than {MOST_BYTES} bytes: closed")
        finally:
            del self._clients[connection]
            sending.cancel()
            with suppress(asyncio.CancelledError, ConnectionClosed):
                await sending
            if self._over is not None and not self._over.is_set():
                self._notices.say(f"page closed by {visitor}")

    async def _listen_to(self, connection: ServerConnection, client: Client[M]) -> None:
        linked_s = 0.0
        async for text in connection:
            try:
                command = parse(text)
            except FormatError as error:
                self._notices.say(f"{client.peer}: {error.found}: closed")
                await connection.close(CloseCode.POLICY_VIOLATION, error.found[:100])
                return
            now_s = time.monotonic()
            self._heed(client, command, now_s)
            if command.do is not None:
                await self._do(connection, client, command)
            elif command.ack is not None and now_s - linked_s > _LINK_EVERY_S:
                linked_s = now_s
                await connection.send(self._link(client))

    def _heed(self, client: Client[M], command: Command, now_s: float) -> None:
        if command.ack is not None:
            client.acknowledged(command.ack, now_s)
        if command.want is not None:
            client.asks_for(frozenset(command.want))
        if command.freeze is not None:
            client.is_frozen = command.freeze
        client.news.set()

    async def _do(self, connection: ServerConnection, client: Client[M], command: Command) -> None:
        deed = command.do
        try:
            text = await asyncio.to_thread(self._deed(client, command))
            is_done = True
        except RigError as error:
            text, is_done = str(error), False
            self._notices.say(str(error))
        await connection.send(json.dumps({"answer": text, "done": is_done, "do": deed}))
        state = self._state()
        for other in tuple(self._clients):
            with suppress(ConnectionClosed):
                await other.send(state)

    def _deed(self, client: Client[M], command: Command) -> Callable[[], str]:
        deed, put = command.do, self._actions.put
        if deed == "put":
            return lambda: put.reason if isinstance(put, Refusal) else put(command.reading)
        save, recording = self._actions.save, self._actions.recording
        if deed == "save":
            shown = client.shown
            if isinstance(save, Refusal):
                return lambda: save.reason
            if shown is None:
                return lambda: "nothing has been shown yet"
            return lambda: save(shown.message)
        if isinstance(recording, Refusal):
            return lambda: recording.reason
        return recording.start if deed == "record" else recording.stop

    def _state(self) -> str:
        save, recording = self._actions.save, self._actions.recording
        return json.dumps(
            {
                "save": save.reason if isinstance(save, Refusal) else None,
                "record": recording.reason if isinstance(recording, Refusal) else None,
                "recording": not isinstance(recording, Refusal) and recording.is_on(),
            }
        )

    def _link(self, client: Client[M]) -> str:
        age_s = client.age_s()
        return json.dumps(
            {
                "age_ms": None if age_s is None else round(1e3 * age_s, 2),
                "skipped": client.skipped,
                "pages": len(self._clients),
            }
        )

    async def _send_newest(self, connection: ServerConnection, client: Client[M]) -> None:
        client.news.set()
        while True:
            await client.news.wait()
            client.news.clear()
            newest = self._newest
            if newest is None or newest.number == client.last:
                continue
            if not client.has_credit:
                if client.is_stalled():
                    self._notices.say(f"{client.peer}: the page draws nothing any more, it waits")
                continue
            data = self._encode(newest, client.wants)
            client.sends(newest)
            await connection.send(data)
            client.news.set()  # something newer may have come while this went out

    def _encode(self, sent: Sent[M], wants: frozenset[str]) -> bytes:
        """Encode once for all pages that want the same."""
        number, data = self._encoded.get(wants, (-1, b""))
        if number != sent.number:
            if len(self._encoded) >= MOST_PAGES:
                self._encoded.clear()
            data = sent.message.encoded(sent.number, wants)
            self._encoded[wants] = (sent.number, data)
        return data

    def _wake(self) -> None:
        for client in self._clients.values():
            client.news.set()
