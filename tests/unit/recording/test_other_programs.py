"""Recordings as other programs see them: the library of MCAP with Foxglove's decoder."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import SeekingReader, make_reader
from mcap_protobuf.decoder import DecoderFactory

from rig.errors import StoreError
from rig.recording import CameraInfo, DepthImages, FrameTransform, RecordingWriter, Scene
from tests.support.recordings import FIRST_NS, VIEWS, taken, time_ns, written

SHAPE = (6, 9)
CAMERA = CameraInfo(
    width_px=9,
    height_px=6,
    lens="brown5",
    coefficients=(0.1, 0.2, 0.3, 0.4, 0.5),
    matrix=np.arange(9.0).reshape(3, 3),
    rectification=np.eye(3)[::-1].copy(),
    projection=np.arange(12.0).reshape(3, 4),
)
TRANSFORM = FrameTransform("rig_link", "left_optical", (0.1, 0.2, 0.3), (-0.5, 0.5, -0.5, 0.5))
SCENE = Scene(
    frame_of={view: f"{view}_optical" for view in VIEWS},
    reference="left",
    transforms=(TRANSFORM,),
    cameras=dict.fromkeys(VIEWS, CAMERA),
    depth_camera=CAMERA,
)


def depth() -> DepthImages:
    depth_m = np.linspace(0.4, 2.5, 54, dtype=np.float32).reshape(SHAPE)
    depth_m[0, 0] = np.nan
    points = np.arange(12, dtype=np.float32).reshape(3, 4)
    label = np.full(SHAPE, 2, np.uint8)
    return DepthImages(depth_m, depth_m / np.float32(100.0), label, points)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "r.mcap"
    with RecordingWriter(path, VIEWS, {"kind": "any", "serial": "7"}) as writer:
        writer.write(taken(0), time_ns(0), None, SCENE)
        writer.write(taken(1), time_ns(1), depth(), SCENE)
        writer.write(taken(2), time_ns(2), depth(), SCENE)
    return path


def test_the_index_names_every_chunk_topic_and_time(recording: Path):
    with recording.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert isinstance(reader, SeekingReader)
        summary = reader.get_summary()
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    assert summary is not None
    assert summary.statistics is not None
    assert len(summary.chunk_indexes) == summary.statistics.chunk_count == 3
    topics = {number: channel.topic for number, channel in summary.channels.items()}
    counts = {topics[n]: count for n, count in summary.statistics.channel_message_counts.items()}
    of_all = ("/left/image", "/left/calibration", "/right/image", "/right/calibration", "/tf")
    depth_topics = ("image", "sigma", "label", "calibration", "points")
    assert counts == {
        **dict.fromkeys((*of_all, "/multi_view"), 3),
        **{f"/depth/{name}": 2 for name in depth_topics},
    }
    assert summary.statistics.message_count == 28
    assert summary.statistics.message_start_time == FIRST_NS
    assert summary.statistics.message_end_time == FIRST_NS + 100_000_000
    assert metadata == {
        "camera": {"kind": "any", "serial": "7"},
        "views": {"0": "left", "1": "right"},
    }


def test_the_summary_has_the_checksum_and_the_groups_that_the_format_asks_for(recording: Path):
    content = recording.read_bytes()
    start, groups_start, checksum = struct.unpack_from("<QQI", content, len(content) - 28)
    assert zlib.crc32(content[start:-12]) == checksum
    groups: list[tuple[int, int]] = []
    at, first = groups_start, start
    while content[at] == Opcode.SUMMARY_OFFSET:
        opcode, begun, length = struct.unpack_from("<BQQ", content, at + 9)
        assert begun == first
        assert content[begun] == opcode
        groups.append((opcode, length))
        at, first = at + 26, begun + length
    assert first == groups_start
    assert content[at] == Opcode.FOOTER
    assert [opcode for opcode, _ in groups] == [3, 4, 11, 8, 13]


def test_every_message_is_what_its_schema_says(recording: Path):
    with recording.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = {
            channel.topic: (schema, message, content)
            for schema, channel, message, content in reader.iter_decoded_messages(
                topics=[
                    "/right/image",
                    "/right/calibration",
                    "/tf",
                    *(f"/depth/{n}" for n in ("image", "sigma", "label", "calibration", "points")),
                ],
                starting_at=time_ns(2),
            )
        }
    assert len(found) == 8
    for schema, message, content in found.values():
        assert schema is not None
        assert schema.encoding == "protobuf"
        assert message.log_time == message.publish_time == time_ns(2)
        stamp = content.transforms[0].timestamp if schema.name.endswith("s") else content.timestamp
        assert stamp.seconds * 1_000_000_000 + stamp.nanos == time_ns(2)
    picture = found["/right/image"][2]
    assert (picture.encoding, picture.width, picture.height, picture.step) == ("mono16", 9, 6, 18)
    assert picture.frame_id == "right_optical"
    pixels = np.frombuffer(picture.data, "<u2").reshape(SHAPE)
    assert np.array_equal(pixels, taken(2).frames[1].image)
    for name, expected, encoding in (
        ("image", depth().depth_m, "32FC1"),
        ("sigma", depth().sigma_m, "32FC1"),
        ("label", depth().label, "mono8"),
    ):
        content = found[f"/depth/{name}"][2]
        assert (content.encoding, content.frame_id) == (encoding, "left_optical")
        values = np.frombuffer(content.data, expected.dtype).reshape(SHAPE)
        assert np.array_equal(values, expected, equal_nan=True)
    for topic in ("/right/calibration", "/depth/calibration"):
        content = found[topic][2]
        assert (content.width, content.height, content.distortion_model) == (9, 6, "plumb_bob")
        assert list(content.D) == [0.1, 0.2, 0.3, 0.4, 0.5]
        assert list(content.K) == [float(i) for i in range(9)]
        assert list(content.R) == [0, 0, 1, 0, 1, 0, 1, 0, 0]
        assert list(content.P) == [float(i) for i in range(12)]
    cloud = found["/depth/points"][2]
    assert [(f.name, f.offset, f.type) for f in cloud.fields] == [
        ("x", 0, 7),
        ("y", 4, 7),
        ("z", 8, 7),
        ("sigma", 12, 7),
    ]
    assert (cloud.point_stride, cloud.pose.orientation.w) == (16, 1.0)
    assert np.array_equal(np.frombuffer(cloud.data, "<f4"), np.arange(12))
    (transform,) = found["/tf"][2].transforms
    assert (transform.parent_frame_id, transform.child_frame_id) == ("rig_link", "left_optical")
    place, turn = transform.translation, transform.rotation
    assert (place.x, place.y, place.z) == (0.1, 0.2, 0.3)
    assert (turn.x, turn.y, turn.z, turn.w) == (-0.5, 0.5, -0.5, 0.5)


def test_without_cameras_there_are_pictures_alone(tmp_path: Path):
    written(tmp_path / "r.mcap", 1)
    with (tmp_path / "r.mcap").open("rb") as file:
        topics = [channel.topic for _, channel, _ in make_reader(file).iter_messages()]
    assert sorted(topics) == ["/left/image", "/multi_view", "/right/image"]


def test_a_view_may_not_take_the_name_of_the_depth_map(tmp_path: Path):
    with pytest.raises(StoreError, match="a view is called depth"):
        RecordingWriter(tmp_path / "r.mcap", ("left", "depth"), {})
    assert not (tmp_path / "r.mcap").exists()
