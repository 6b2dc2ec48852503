"""`rig export CAPTURE_FOLDER --format rosbag2`, read back by `rosbags` and by `mcap`."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import ConnectionExtRosbag2

import rig
from rig.capture.capture import CaptureRequest, capture_depth
from rig.errors import ConfigError, StoreError
from rig.export.formats import FORMATS
from rig.export.rosbag2 import Rosbag2Export
from rig.testing.simulated import PROFILE, open_simulated_rig
from tests.support.command import Command

TOPICS = (
    "/reference/image_rect",
    "/reference/camera_info",
    "/depth/image",
    "/depth/image_raw",
    "/depth/sigma",
    "/depth/camera_info",
    "/depth/points",
)


@pytest.fixture(scope="module")
def captured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("captured") / "maps"
    request = CaptureRequest(frames=2, duration_s=None, folder=folder)
    with open_simulated_rig() as camera:
        capture_depth(camera, request, lambda *_: None)
    return folder


def messages_of(bag: Path) -> list[tuple[str, int, Any]]:
    with AnyReader([bag]) as reader:
        return [
            (connection.topic, time_ns, reader.deserialize(raw, connection.msgtype))
            for connection, time_ns, raw in reader.messages()
        ]


def test_a_bag_holds_what_the_folder_holds(captured: Path, tmp_path: Path):
    told = FORMATS["rosbag2"].load_capture()().export(captured, tmp_path / "bag")
    assert (told.path, told.frames) == (tmp_path / "bag", 2)
    frames = list(rig.read_capture(captured))
    messages = messages_of(tmp_path / "bag")
    assert messages[0][0] == "/tf_static"
    (transform,) = messages[0][2].transforms
    assert transform.child_frame_id == "reference_optical_frame"
    place = transform.transform.translation
    assert (place.x, place.y, place.z) == (0.0, 0.0, 0.0)
    points = 0
    for frame in frames:
        found = {topic: m for topic, t, m in messages if t == frame.time_ns and "tf" not in topic}
        assert tuple(found) == TOPICS
        depth = found["/depth/image"]
        assert (depth.encoding, depth.header.frame_id) == ("32FC1", "reference_optical_frame")
        depth_m = np.frombuffer(depth.data, "<f4").reshape(100, 160)
        assert depth_m == pytest.approx(frame.depth_mm / 1000.0, rel=1e-6, nan_ok=True)
        picture = np.frombuffer(found["/reference/image_rect"].data, np.uint8).reshape(100, 160)
        assert frame.image is not None
        assert (picture == frame.image).all()
        for topic in ("/depth/camera_info", "/reference/camera_info"):
            assert (found[topic].k.reshape(3, 3) == frame.camera.matrix).all()
        points += found["/depth/points"].width
    assert told.points == points == sum(np.isfinite(frame.depth_mm).sum() for frame in frames)


def test_a_second_reader_agrees(captured: Path, tmp_path: Path):
    Rosbag2Export(frames="1").export(captured, tmp_path / "bag")
    with (tmp_path / "bag" / "bag.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = {channel.topic: m for _, channel, _, m in reader.iter_decoded_messages()}
    (frame,) = (f for f in rig.read_capture(captured) if f.index == 1)
    raw = np.frombuffer(bytes(found["/depth/image_raw"].data), "<u2").reshape(100, 160)
    assert (raw == np.rint(np.nan_to_num(frame.depth_mm))).all()
    assert set(found) == {*TOPICS, "/tf_static"}
    with AnyReader([tmp_path / "bag"]) as reader:
        (connection,) = (c for c in reader.connections if c.topic == "/tf_static")
        assert isinstance(connection.ext, ConnectionExtRosbag2)
        assert connection.ext.offered_qos_profiles[0].durability.name == "TRANSIENT_LOCAL"


def test_what_makes_no_bag_is_told(captured: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    bag = tmp_path / "bag"
    bag.mkdir()
    with pytest.raises(StoreError, match="bag: exists already; name another"):
        Rosbag2Export().export(captured, bag)
    bag.rmdir()
    with pytest.raises(StoreError, match="asked for frame 7"):
        Rosbag2Export(frames="0,7").export(captured, bag)
    assert not bag.exists()
    with pytest.raises(StoreError, match="no/bag: cannot be written"):
        (tmp_path / "no").write_text("a file")
        Rosbag2Export().export(captured, tmp_path / "no" / "bag")
    with pytest.raises(ConfigError, match="frames 'x'"):
        Rosbag2Export(frames="x")
    old = tmp_path / "old"
    old.mkdir()
    facts = json.loads((captured / "frames.jsonl").read_text().splitlines()[0])
    del facts["time_ns"]
    (old / "frames.jsonl").write_text(json.dumps(facts))
    with pytest.raises(StoreError, match="frame 0 has no wall-clock time"):
        Rosbag2Export().export(old, bag)
    (old / "frames.jsonl").write_text("")
    with pytest.raises(StoreError, match="has no frames"):
        Rosbag2Export().export(old, bag)
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(ConfigError, match=r"rosbags is not installed; pip install 'epirig\[ros\]'"):
        Rosbag2Export().export(captured, bag)


def test_slopes_alone_make_no_bag(tmp_path: Path):
    request = CaptureRequest(frames=1, duration_s=None, folder=tmp_path / "maps")
    with rig.open(PROFILE, curve="none", calibration="none") as camera:
        capture_depth(camera, request, lambda *_: None)
    with pytest.raises(StoreError, match="holds slopes only, asked for depth"):
        Rosbag2Export().export(tmp_path / "maps", tmp_path / "bag")
    assert not (tmp_path / "bag").exists()


def test_the_verb_writes_a_bag(captured: Path, tmp_path: Path, rig: Command):
    told = rig("export", str(captured), "--format", "rosbag2", "--out", str(tmp_path / "bag"))
    assert told.code == 0, told.err
    assert (tmp_path / "bag" / "metadata.yaml").is_file()
