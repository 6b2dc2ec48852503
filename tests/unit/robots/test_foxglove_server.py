"""`--serve foxglove`, by a client that speaks the sub-protocol of Foxglove's SDK."""

import json
import struct
import sys
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from rig.errors import ConfigError, OutputError
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.robots.foxglove_server import FoxgloveServer
from rig.testing.simulated import open_simulated_rig

PROTOCOL = Subprotocol("foxglove.sdk.v1")


@pytest.fixture(scope="module")
def opened() -> Iterator[tuple[DepthCamera, DepthFrame]]:
    with open_simulated_rig() as camera:
        yield camera, next(iter(camera))


@contextmanager
def serving(camera: DepthCamera, **options: Any) -> Generator[FoxgloveServer]:
    server = FoxgloveServer(camera, port=0, **options)
    try:
        yield server
    finally:
        server.close()


class Client:
    """The few verbs of the protocol that a viewer needs."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.channels: dict[str, dict[str, Any]] = {}

    def told(self, op: str) -> dict[str, Any]:
        """Wait for a message of the server of one kind."""
        while True:
            message = self.socket.recv(timeout=10.0)
            if isinstance(message, str) and (content := json.loads(message))["op"] == op:
                return content

    def learn(self) -> None:
        for channel in self.told("advertise")["channels"]:
            self.channels[channel["topic"]] = channel

    def subscribe(self, topics: dict[str, int]) -> None:
        """Ask for topics under numbers of the client's own."""
        wanted = [
            {"id": number, "channelId": self.channels[topic]["id"]}
            for topic, number in topics.items()
        ]
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def data(self) -> tuple[int, int, bytes]:
        """Return subscription, time and content of the next message with data."""
        while True:
            message = self.socket.recv(timeout=10.0)
            if isinstance(message, bytes):
                opcode, number, time_ns = struct.unpack_from("<BIQ", message)
                assert opcode == 1
                return number, time_ns, message[13:]


@contextmanager
def client_of(server: FoxgloveServer) -> Generator[Client]:
    address = f"ws://127.0.0.1:{server.port}"
    with connect(address, subprotocols=[PROTOCOL], max_size=None, close_timeout=0.5) as socket:
        assert socket.subprotocol == PROTOCOL
        client = Client(socket)
        assert client.told("serverInfo")["name"] == "simulated-rig"
        yield client


def until_data(server: FoxgloveServer, frame: DepthFrame, client: Client) -> tuple[int, int, bytes]:
    """Write until the subscription has reached the server."""
    for _ in range(200):
        server.write(frame)
        try:
            message = client.socket.recv(timeout=0.1)
        except TimeoutError:
            continue
        if isinstance(message, bytes):
            return struct.unpack_from("<BIQ", message)[1], 0, message[13:]
    raise AssertionError("no data came")


def test_a_viewer_finds_the_topics_and_gets_what_it_asks_for(
    opened: tuple[DepthCamera, DepthFrame],
):
    camera, frame = opened
    with serving(camera, points=True) as server:
        server.write(frame)
        with client_of(server) as client:
            while len(client.channels) < 16:
                client.learn()
            names = {topic: channel["schemaName"] for topic, channel in client.channels.items()}
            assert {names[f"/{view}/image"] for view in camera.views} == {"foxglove.RawImage"}
            assert names["/left/calibration"] == "foxglove.CameraCalibration"
            assert names["/depth/points"] == "foxglove.PointCloud"
            assert names["/tf"] == "foxglove.FrameTransforms"
            wanted = {"/depth/image": 7, "/left/image": 8, "/left/calibration": 9, "/tf": 10}
            client.subscribe(wanted)
            first, _, content = until_data(server, frame, client)
            found = {first: content}
            while len(found) < 4:
                number, time_ns, content = client.data()
                assert time_ns == frame.time_ns
                found[number] = content
    depth = RawImage.FromString(found[7])
    depth_m = np.frombuffer(depth.data, "<f4").reshape(100, 160)
    assert depth_m == pytest.approx(frame.depth_mm / 1000.0, rel=1e-6, nan_ok=True)
    left = RawImage.FromString(found[8])
    assert (np.frombuffer(left.data, np.uint8) == frame.views.frames[1].image.ravel()).all()
    assert CameraCalibration.FromString(found[9]).frame_id == "left_optical_frame"
    assert len(FrameTransforms.FromString(found[10]).transforms) == 5


def test_a_viewer_that_goes_or_never_reads_changes_nothing(
    opened: tuple[DepthCamera, DepthFrame],
):
    camera, frame = opened
    with serving(camera) as server:
        server.write(frame)
        with client_of(server) as gone:
            gone.learn()
            gone.subscribe({next(iter(gone.channels)): 1})
        with client_of(server) as idle:
            while len(idle.channels) < 15:
                idle.learn()
            idle.subscribe({"/depth/image": 1})
            until_data(server, frame, idle)
            for _ in range(300):  # far more than a socket takes
                server.write(frame)
            idle.socket.send("{rubbish")
            server.write(frame)
        with client_of(server) as another:
            another.learn()
            assert another.channels


def test_a_port_that_is_taken_and_an_address_that_is_none_are_told(
    opened: tuple[DepthCamera, DepthFrame],
):
    camera, _ = opened
    with serving(camera) as server:
        with pytest.raises(OutputError, match=rf"127\.0\.0\.1:{server.port}: .*--serve-port"):
            FoxgloveServer(camera, port=server.port)
        with pytest.raises(OutputError, match=r"asked to serve Foxglove at nowhere\.invalid:0"):
            FoxgloveServer(camera, host="nowhere.invalid", port=0)


def test_a_missing_extra_is_told(
    opened: tuple[DepthCamera, DepthFrame], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(ConfigError, match=r"foxglove is not installed; .*epirig\[foxglove\]"):
        FoxgloveServer(opened[0])
