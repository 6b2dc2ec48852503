"""What `--record X.mcap --as ros2` writes, by two readers that are not ours."""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import ConnectionExtRosbag2

from rig.capture.capture import CaptureRequest, capture_depth
from rig.capture.recording import CaptureRecording
from rig.depth import DepthMap
from rig.errors import ConfigError, StoreError
from rig.geometry.pinhole import Pinhole
from rig.live.frame import DepthFrame
from rig.robots.depth import DepthForRobots
from rig.robots.pictures import RectifiedPictures
from rig.robots.ros2_messages import Ros2Messages
from rig.robots.ros2_recording import Ros2Recording, require_no_depth
from rig.robots.scene import scene_of
from rig.testing.simulated import open_simulated_rig
from tests.unit.robots.robot_rig import geometry, optics, run

VIEWS = ("centre", "left", "right", "top", "bottom")
DEPTH_TOPICS = ("image", "image_raw", "sigma", "camera_info", "points")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[DepthFrame]]:
    """Two frames of the simulated rig and their bag."""
    path = tmp_path_factory.mktemp("ros2") / "r.mcap"
    with open_simulated_rig() as camera:
        output = Ros2Recording(path, camera, points=True)
        frames = [frame for frame, _ in zip(camera, range(2), strict=False)]
        for frame in frames:
            output.write(frame)
        output.close()
    return path, frames


def by_rosbags(path: Path) -> Iterator[tuple[str, int, Any]]:
    with AnyReader([path]) as reader:
        for connection, time_ns, raw in reader.messages():
            yield connection.topic, time_ns, reader.deserialize(raw, connection.msgtype)


def by_mcap(path: Path) -> Iterator[tuple[str, int, Any]]:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, content in reader.iter_decoded_messages():
            yield channel.topic, message.log_time, content


def pixels(message: Any, kind: str) -> np.ndarray:
    assert message.is_bigendian == 0
    assert message.step == message.width * np.dtype(kind).itemsize
    return np.frombuffer(bytes(message.data), kind).reshape(message.height, message.width)


@pytest.mark.slow
@pytest.mark.parametrize("read", [by_rosbags, by_mcap])
def test_both_readers_find_every_topic_as_it_was(
    recorded: tuple[Path, list[DepthFrame]], read: Any
):
    path, frames = recorded
    found: dict[int, dict[str, Any]] = {}
    for topic, time_ns, message in read(path):
        found.setdefault(time_ns, {})[topic] = message
    of_all = {f"/{v}/{t}" for v in VIEWS for t in ("image_rect", "camera_info")}
    of_all |= {f"/depth/{topic}" for topic in DEPTH_TOPICS}
    assert set(found[frames[0].time_ns]) == of_all | {"/tf_static"}
    assert set(found[frames[1].time_ns]) == of_all
    for frame in frames:
        topics = found[frame.time_ns]
        assert_pictures(topics, frame)
        assert_depth(topics, frame)


def assert_pictures(topics: dict[str, Any], frame: DepthFrame) -> None:
    for one in frame.views.frames:
        image, info = topics[f"/{one.view}/image_rect"], topics[f"/{one.view}/camera_info"]
        assert image.encoding == "mono8"
        assert (pixels(image, "u1") == one.image).all()
        for message in (image, info):
            stamp = message.header.stamp
            assert stamp.sec * 1_000_000_000 + stamp.nanosec == frame.time_ns
            assert message.header.frame_id == f"{one.view}_optical_frame"
            assert (message.width, message.height) == (160, 100)
    left, centre = topics["/left/camera_info"], topics["/centre/camera_info"]
    assert centre.p[3] == 0.0
    assert left.p[3] == pytest.approx(-left.p[0] * -1.06 * 0.04)
    assert list(left.d) == [0.0] * 5
    assert left.distortion_model == "plumb_bob"
    assert list(left.r) == [1, 0, 0, 0, 1, 0, 0, 0, 1]


def assert_depth(topics: dict[str, Any], frame: DepthFrame) -> None:
    assert topics["/depth/image"].encoding == "32FC1"
    assert topics["/depth/image"].header.frame_id == "centre_optical_frame"
    depth_m = pixels(topics["/depth/image"], "<f4")
    assert (np.isnan(depth_m) == np.isnan(frame.depth_mm)).all()
    assert depth_m == pytest.approx(frame.depth_mm / 1000.0, rel=1e-6, nan_ok=True)
    sigma_m = pixels(topics["/depth/sigma"], "<f4")
    assert sigma_m == pytest.approx(frame.sigma_mm / 1000.0, rel=1e-6, nan_ok=True)
    assert topics["/depth/image_raw"].encoding == "16UC1"
    raw = pixels(topics["/depth/image_raw"], "<u2")
    assert (raw == np.rint(np.nan_to_num(frame.depth_mm))).all()
    info = topics["/depth/camera_info"]
    assert (np.array(info.k).reshape(3, 3) == frame.camera.matrix).all()
    cloud = topics["/depth/points"]
    assert [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields] == [
        ("x", 0, 7, 1),
        ("y", 4, 7, 1),
        ("z", 8, 7, 1),
        ("sigma", 12, 7, 1),
    ]
    points = np.frombuffer(bytes(cloud.data), "<f4").reshape(-1, 4)
    assert (cloud.height, cloud.width) == (1, len(points))
    assert (cloud.point_step, cloud.row_step) == (16, 16 * len(points))
    known = np.isfinite(frame.depth_mm)
    expected = frame.points_mm()[known] / 1000.0
    assert points[:, :3] == pytest.approx(expected, rel=1e-5, abs=1e-7)


def test_transforms_wait_for_who_subscribes_later(recorded: tuple[Path, list[DepthFrame]]):
    with AnyReader([recorded[0]]) as reader:
        (connection,) = (c for c in reader.connections if c.topic == "/tf_static")
        assert isinstance(connection.ext, ConnectionExtRosbag2)
        (service,) = connection.ext.offered_qos_profiles
        ((_, _, raw),) = reader.messages([connection])
        message: Any = reader.deserialize(raw, connection.msgtype)
    assert service.durability.name == "TRANSIENT_LOCAL"
    assert service.reliability.name == "RELIABLE"
    assert [t.child_frame_id for t in message.transforms] == [f"{v}_optical_frame" for v in VIEWS]
    assert {t.header.frame_id for t in message.transforms} == {"rig_link"}
    right = message.transforms[2].transform
    assert right.translation.y == pytest.approx(-0.93 * 0.04)
    turn = right.rotation
    assert (turn.x, turn.y, turn.z, turn.w) == (-0.5, 0.5, -0.5, 0.5)


def test_a_calibrated_rig_names_its_lenses_and_rectifies_its_pictures():
    scene = scene_of(run(), (100, 160), optics().rectification.pinhole)
    messages = Ros2Messages()
    picture = np.zeros((100, 160), np.uint8)
    found = {
        message.topic: messages.typestore.deserialize_cdr(
            b"".join(message.payload), message.msgtype
        )
        for message in messages.of(dict.fromkeys(VIEWS, picture), None, scene, 7)
    }
    models = [found[f"/{view}/camera_info"].distortion_model for view in VIEWS]
    assert models == [
        "plumb_bob",
        "rational_polynomial",
        "equidistant",
        "plumb_bob",
        "plumb_bob",
    ]
    assert list(found["/right/camera_info"].d) == [0.01, -0.002, 0.0, 0.0]
    assert len(found) == 10


def test_without_a_focal_length_cameras_are_marked_as_not_calibrated():
    bare = scene_of(run(), (100, 160), None)
    bare.cameras.clear()
    messages = Ros2Messages()
    depth = DepthForRobots(None, points=True).of(
        np.full((2, 3), 500.0, np.float32), np.ones((2, 3), np.float32), np.ones((2, 3), np.uint8)
    )
    found = {
        message.topic: messages.typestore.deserialize_cdr(
            b"".join(message.payload), message.msgtype
        )
        for message in messages.of({"left": np.zeros((2, 3), np.uint16)}, depth, bare, 7)
    }
    assert "/depth/points" not in found
    assert found["/left/image_rect"].encoding == "mono16"
    for topic in ("/left/camera_info", "/depth/camera_info"):
        info = found[topic]
        assert (info.width, info.height, info.distortion_model) == (3, 2, "")
        assert not info.k.any()
        assert not info.r.any()
        assert not info.p.any()
        assert info.d.size == 0


def test_a_frame_without_any_answer_has_an_empty_cloud(tmp_path: Path):
    with open_simulated_rig() as camera:
        frame = next(iter(camera))
        nothing = np.full((100, 160), np.nan, np.float32)
        blind = replace(frame, depth=DepthMap(nothing, nothing, np.zeros((100, 160), np.uint8)))
        outputs = (
            Ros2Recording(tmp_path / "ros2.mcap", camera, points=True),
            CaptureRecording(tmp_path / "foxglove.mcap", camera, points=True),
        )
        for output in outputs:
            output.write(blind)
            output.close()
    found = {topic: message for topic, _, message in by_rosbags(tmp_path / "ros2.mcap")}
    assert found["/depth/points"].width == 0
    assert not pixels(found["/depth/image_raw"], "<u2").any()
    with (tmp_path / "foxglove.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[ProtobufDecoders()])
        ((_, _, _, cloud),) = reader.iter_decoded_messages(topics=["/depth/points"])
    assert (cloud.point_stride, cloud.data) == (16, b"")


def test_pictures_are_rectified_as_the_calibration_says():
    rectification = optics().rectification
    columns, rows = np.meshgrid(np.arange(160.0), np.arange(100.0))
    # A ramp that linear interpolation keeps exactly.
    ramp = (200.0 * columns + 100.0 * rows).astype(np.uint16)
    with open_simulated_rig() as camera:
        taken = next(iter(camera))
    frames = tuple(replaced(frame, ramp) for frame in taken.views.frames)
    frame = of_views(taken, frames, rectification.pinhole)
    found = RectifiedPictures(run()).of(frame)
    assert found["centre"] is frame.image
    smaller = RectifiedPictures(run()).of(replace(frame, image=frame.image[::2, ::2]))
    assert smaller["centre"].shape == (100, 160)
    for view, name in enumerate(geometry().names[1:], start=1):
        source = rectification.raw_map_px(view)
        inside = ((source > 1.0) & (source < (158.0, 98.0))).all(axis=-1)
        expected = 200.0 * source[..., 0] + 100.0 * source[..., 1]
        assert inside.sum() > 9000
        # The library places pictures to 1/32 px.
        assert np.abs(found[name][inside] - expected[inside]).max() < 300.0 / 32.0 + 1.0, name
        outside = (source < -1.0).any(axis=-1)
        assert not found[name][outside].any()


def replaced(frame: Any, image: np.ndarray) -> Any:
    return replace(frame, image=image, bits=None)


def of_views(taken: DepthFrame, frames: tuple[Any, ...], pinhole: Pinhole) -> DepthFrame:
    return replace(taken, views=replace(taken.views, frames=frames), pinhole=pinhole)


def test_a_capture_records_it_and_never_overwrites(tmp_path: Path):
    path = tmp_path / "r.mcap"
    request = CaptureRequest(
        frames=1, duration_s=None, folder=None, recording=path, recorded_as="ros2"
    )
    with open_simulated_rig() as camera:
        summary = capture_depth(camera, request, lambda *_: None)
    assert summary.failure is None
    topics = {topic for topic, _, _ in by_rosbags(path)}
    assert "/depth/image" in topics
    assert "/depth/points" not in topics
    with open_simulated_rig() as camera, pytest.raises(StoreError, match="exists already"):
        capture_depth(camera, request, lambda *_: None)


def test_a_missing_extra_is_told(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(ConfigError, match=r"rosbags is not installed; pip install 'epirig\[ros\]'"):
        Ros2Messages()


def test_a_view_may_not_be_called_depth():
    with pytest.raises(StoreError, match="a view is called depth"):
        require_no_depth(("left", "depth"))
    assert require_no_depth(("left", "depths")) is None
