"""One frame in colour through every output, read back by readers that are not ours."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from rig.capture.folder import CaptureFolder
from rig.errors import StoreError
from rig.export.cloud import cloud_of
from rig.export.rosbag2 import Rosbag2Export
from rig.frames import Frame, MultiView
from rig.live.captured import read_capture
from rig.live.frame import DepthFrame
from rig.recording import RecordingWriter, recorded
from rig.robots.depth import DepthForRobots
from rig.robots.pictures import RectifiedPictures
from rig.robots.ros2_messages import Ros2Messages
from rig.robots.scene import scene_of
from rig.stored import Run
from rig.view.frame_message import FrameMessage, Pace
from rig.view.wire import decode
from tests.support.shown_frames import scene
from tests.unit.robots.robot_rig import run as calibrated_run

SCENE = scene()
TIME_NS = 1_790_000_000_123_456_789


def in_colour() -> DepthFrame:
    """A frame whose views have colours of their own, and one view that has none."""
    frame = SCENE.frame(3)
    random = np.random.default_rng(7)
    frames = tuple(
        replace(one, colour=random.integers(0, 256, (*one.image.shape, 3), dtype=np.uint8))
        for one in frame.views.frames
    )
    frames = (*frames[:-1], replace(frames[-1], colour=None))
    reference = SCENE.run.profile.reference
    return replace(frame, views=MultiView(frames), colour=frames[reference].colour)


FRAME = in_colour()


def expected_points(frame: DepthFrame) -> np.ndarray:
    assert frame.colour is not None
    return frame.colour[np.isfinite(frame.depth_mm)]


def test_a_recording_keeps_colour_and_gives_it_back(tmp_path: Path):
    path = tmp_path / "r.mcap"
    assert FRAME.pinhole is not None
    seen = DepthForRobots(FRAME.pinhole, points=True).of(
        FRAME.depth_mm, FRAME.sigma_mm, FRAME.label, FRAME.colour
    )
    views = [frame.view for frame in FRAME.views.frames]
    with RecordingWriter(path, views, {}) as writer:
        writer.write(FRAME.views, TIME_NS, seen)
    (found,) = recorded(path)
    for one, other in zip(found.views.frames, FRAME.views.frames, strict=True):
        assert np.array_equal(one.image, other.image)
        if other.colour is None:
            assert one.colour is None
        else:
            assert one.colour is not None
            assert np.array_equal(one.colour, other.colour)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        topics = [f"/{view}/colour" for view in views] + ["/depth/points"]
        messages = {
            channel.topic: content
            for _, channel, _, content in reader.iter_decoded_messages(topics=topics)
        }
    colour = FRAME.views.frames[0].colour
    assert colour is not None
    picture = messages[f"/{views[0]}/colour"]
    assert (picture.encoding, picture.step) == ("rgb8", 3 * picture.width)
    assert picture.data == colour.tobytes()
    assert f"/{views[-1]}/colour" not in messages
    cloud = messages["/depth/points"]
    fields = {field.name: (field.offset, field.type) for field in cloud.fields}
    assert fields == {
        **{name: (4 * n, 7) for n, name in enumerate(("x", "y", "z", "sigma"))},
        **{name: (16 + n, 1) for n, name in enumerate(("blue", "green", "red", "alpha"))},
    }
    assert cloud.point_stride == 20
    raw = np.frombuffer(cloud.data, np.uint8).reshape(-1, 20)
    assert np.array_equal(raw[:, [18, 17, 16]], expected_points(FRAME))
    assert (raw[:, 19] == 255).all()


@pytest.mark.parametrize("wrong", ["grey", "size"])
def test_a_recording_whose_colour_is_none_is_damaged(tmp_path: Path, wrong: str):
    image = np.zeros((4, 6), np.uint8)
    # What belongs into the topic of the colour, but is grey or of another size.
    colour = image if wrong == "grey" else np.zeros((4, 5, 3), np.uint8)
    frames = MultiView((Frame("a", image, 1.0, 1, colour=colour), Frame("b", image, 1.0, 1)))
    with RecordingWriter(tmp_path / "r.mcap", ("a", "b"), {}) as writer:
        writer.write(frames, TIME_NS)
    said = "a grey picture where one in colour" if wrong == "grey" else "colour of another size"
    with pytest.raises(StoreError, match=said):
        list(recorded(tmp_path / "r.mcap"))


def test_a_picture_in_colour_is_no_grey_one(tmp_path: Path):
    wrong: Any = np.zeros((4, 6, 3), np.uint8)
    frames = MultiView((Frame("a", wrong, 1.0, 1), Frame("b", wrong, 1.0, 1)))
    with RecordingWriter(tmp_path / "r.mcap", ("a", "b"), {}) as writer:
        writer.write(frames, TIME_NS)
    with pytest.raises(StoreError, match="in colour where a grey one belongs"):
        list(recorded(tmp_path / "r.mcap"))


def test_topics_of_ros_have_colour_beside_grey():
    messages = Ros2Messages()
    assert FRAME.pinhole is not None
    height, width = FRAME.image.shape
    told = scene_of(SCENE.run, (height, width), FRAME.pinhole)
    pictures = RectifiedPictures(SCENE.run)
    depth = DepthForRobots(FRAME.pinhole, points=True).of(
        FRAME.depth_mm, FRAME.sigma_mm, FRAME.label, FRAME.colour
    )
    found = {
        message.topic: messages.typestore.deserialize_cdr(
            b"".join(message.payload), message.msgtype
        )
        for message in messages.of(
            pictures.of(FRAME), depth, told, TIME_NS, pictures.colours_of(FRAME)
        )
    }
    coloured = [topic for topic in found if topic.endswith("/image_rect_color")]
    assert len(coloured) == len(FRAME.views.frames) - 1
    image = found[coloured[0]]
    assert (image.encoding, image.height, image.width) == ("rgb8", height, width)
    assert image.step == 3 * width
    taken = FRAME.views.frames[0].colour
    assert taken is not None
    assert np.array_equal(image.data, taken.ravel())
    cloud = found["/depth/points"]
    fields = [(field.name, field.offset, field.datatype) for field in cloud.fields]
    assert fields[-1] == ("rgb", 16, 7)
    assert (cloud.point_step, cloud.row_step) == (20, 20 * cloud.width)
    raw = np.asarray(cloud.data).reshape(-1, 20)
    assert np.array_equal(raw[:, [18, 17, 16]], expected_points(FRAME))
    assert cloud.is_dense


def test_colour_of_a_calibrated_rig_is_rectified_as_the_grey_picture_is():
    run: Run = calibrated_run()
    random = np.random.default_rng(2)
    noise = random.integers(0, 256, (100, 160), dtype=np.uint8)
    grey = np.asarray(cv2.GaussianBlur(noise, (0, 0), 2.0), np.uint8)
    colour = np.stack([grey, grey, 255 - grey], axis=-1).astype(np.uint8)
    names = [view.name for view in run.profile.views]
    frames = tuple(Frame(name, grey, 1.0, 1, colour=colour) for name in names)
    reference = run.optics.reference_picture(colour)
    frame = replace(
        FRAME, views=MultiView(frames), image=run.optics.reference_picture(grey), colour=reference
    )
    pictures = RectifiedPictures(run)
    greys, colours = pictures.of(frame), pictures.colours_of(frame)
    assert set(colours) == set(names)
    for name in names:
        assert np.array_equal(colours[name][..., 0], greys[name]), name
    assert colours[names[run.profile.reference]] is reference
    # Maps that are smaller bring no picture of the right size along.
    small = replace(frame, colour=reference[::2, ::2])
    again = pictures.colours_of(small)[names[run.profile.reference]]
    assert again.shape == reference.shape


def test_a_page_gets_colour_while_it_asks_for_it():
    shown = FrameMessage(FRAME, Pace(None, {}), SCENE.run)
    _, arrays = decode(shown.encoded(1, frozenset({"colour"})))
    assert FRAME.colour is not None
    assert np.array_equal(arrays["colour"], FRAME.colour)
    assert "colour" not in decode(shown.encoded(1, frozenset({"views"})))[1]
    grey = FrameMessage(replace(FRAME, colour=None), Pace(None, {}), SCENE.run)
    assert "colour" not in decode(grey.encoded(1, frozenset({"colour"})))[1]


def test_a_capture_folder_keeps_colour_for_clouds_and_bags(tmp_path: Path):
    folder = CaptureFolder(tmp_path / "c", SCENE.run)
    folder.write(FRAME)
    folder.close()
    (frame,) = read_capture(tmp_path / "c")
    assert frame.colour is not None
    assert FRAME.colour is not None
    assert np.array_equal(frame.colour, FRAME.colour)
    cloud = cloud_of(frame)
    assert cloud.rgb is not None
    assert np.array_equal(cloud.rgb, FRAME.colour)
    picture = cv2.imread(str(tmp_path / "c" / "last_frame.png"))
    assert picture is not None
    height, width = FRAME.image.shape
    assert np.array_equal(picture[:height, :width, ::-1], FRAME.colour)
    Rosbag2Export().export(tmp_path / "c", tmp_path / "bag")
    with AnyReader([tmp_path / "bag"]) as reader:
        found = {c.topic: reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages()}
    image: Any = found["/reference/image_rect_color"]
    assert np.array_equal(image.data, FRAME.colour.ravel())
    bagged: Any = found["/depth/points"]
    assert bagged.point_step == 20
