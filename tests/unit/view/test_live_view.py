"""The page as an output of a capture."""

import json
import threading
from contextlib import closing

from websockets.sync.client import connect

from rig.live.frame import DepthFrame
from rig.view.actions import Actions, Refusal
from rig.view.frame_message import FrameMessage
from rig.view.live_view import LiveView, capture_save
from rig.view.notices import Notices
from rig.view.server import ViewServer
from rig.view.wire import decode
from tests.support.shown_frames import scene

SCENE = scene()
SOON_S = 20.0


def test_frames_come_with_the_pace_of_the_capture():
    now = [100.0]
    saved: list[int] = []

    def save(frame: DepthFrame) -> str:
        saved.append(frame.index)
        return f"saved {frame.index}"

    actions = Actions(capture_save(save), Refusal("not here"))
    server = ViewServer("127.0.0.1", 0, "abc", Notices(lambda _: None), actions).start()
    view = LiveView(SCENE.run, lambda: {"queue": 4}, server, lambda: now[0])
    assert view.name == "view"
    url = f"{server.url.replace('http', 'ws')}live"
    with closing(view), connect(url, max_size=None, compression=None) as page:
        assert json.loads(page.recv(SOON_S))["record"] == "not here"
        view.write(SCENE.frame(5))
        first = decode(bytes(page.recv(SOON_S)))[0]  # type: ignore[arg-type]
        assert first["frames_per_s"] is None
        now[0] = 100.25
        view.write(SCENE.frame(6))
        second = decode(bytes(page.recv(SOON_S)))[0]  # type: ignore[arg-type]
        assert second["frames_per_s"] == 4.0
        assert (second["frame"], second["dropped"]) == (6, {"queue": 4})
        page.send(json.dumps({"ack": 1}))
        page.send(json.dumps({"do": "save"}))
        while "answer" not in (told := json.loads(page.recv(SOON_S))):
            pass
        assert told["answer"] == "saved 6"
        assert saved == [6]


def test_it_ends_with_its_thread():
    server = ViewServer[FrameMessage]("localhost", 0, "abc", Notices(lambda _: None)).start()
    assert "rig view" in [one.name for one in threading.enumerate()]
    LiveView(SCENE.run, dict, server).close()
    assert "rig view" not in [one.name for one in threading.enumerate()]
