"""The page as an output of a capture."""

import json
import threading
from contextlib import closing

from websockets.sync.client import connect

from rig.view.actions import Recording, Refusal
from rig.view.live_view import LiveView, serve_capture
from rig.view.wire import decode
from tests.support.shown_frames import scene

SCENE = scene()
SOON_S = 20.0


def test_frames_come_with_the_pace_of_the_capture():
    now = [100.0]
    saved: list[int] = []
    server = serve_capture(
        "127.0.0.1",
        0,
        "abc",
        lambda _: None,
        lambda frame: saved.append(frame.index) or f"saved {frame.index}",
        Refusal("not here"),
    )
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
    recording = Recording(lambda: "", lambda: "", lambda: False)
    server = serve_capture("localhost", 0, "abc", lambda _: None, Refusal("no"), recording)
    assert "rig view" in [one.name for one in threading.enumerate()]
    LiveView(SCENE.run, dict, server).close()
    assert "rig view" not in [one.name for one in threading.enumerate()]
