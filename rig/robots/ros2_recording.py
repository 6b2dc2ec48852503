"""`rig capture --record FILE.mcap --as ros2`: a rosbag2 in one MCAP file, written live.

What `ros2 bag` and the library `rosbags` open. Nothing is compressed: that costs more than all the
rest of a frame. Chunks have no checksums, as those of `rosbags` have none.
"""

from pathlib import Path
from typing import Final

from rig.errors import StoreError
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.recording.mcap_writer import McapWriter, Payload
from rig.robots.frames import RobotFrames
from rig.robots.pictures import RectifiedPictures
from rig.robots.ros2_messages import DEPTH, TRANSFORMS, Ros2Message, Ros2Messages
from rig.robots.scene import robot_name

LATCHED: Final = """\
- history: keep_last
  depth: 1
  reliability: reliable
  durability: transient_local
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false"""
"""Quality of service of `/tf_static`: who subscribes later gets it as well."""


class Ros2Recording:
    """Records rectified pictures, cameras, depth and transforms as topics of ROS 2.

    Args:
        path: must not exist.
        camera: open.
        points: whether to record the cloud as well.

    Raises:
        ConfigError: the extra `ros` is not installed.
        StoreError: the file exists or cannot be written, or a view has a name that is taken.
    """

    name = "recording"

    def __init__(self, path: Path, camera: DepthCamera, *, points: bool = False) -> None:
        self._messages = Ros2Messages()
        require_no_depth(camera.views)
        self._frames = RobotFrames(camera.run, points=points)
        self._pictures = RectifiedPictures(camera.run)
        self._file = McapWriter(path, "ros2", has_checksums=False)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def write(self, frame: DepthFrame) -> None:
        """Append the messages of one frame.

        Raises:
            ConfigError: names of the views fit no topics.
            StoreError: the disk is full or gone.
        """
        seen = self._frames.of(frame)
        pictures, colours = self._pictures.of(frame), self._pictures.colours_of(frame)
        messages = list(self._messages.of(pictures, seen.depth, seen.scene, frame.time_ns, colours))
        if not self._channels:
            messages.insert(0, self._messages.transforms(seen.scene, frame.time_ns))
        chunk: list[tuple[int, Payload]] = [
            (self._channel(message), message.payload) for message in messages
        ]
        self._file.write(chunk, frame.time_ns)

    def close(self) -> None:
        """End the file.

        Raises:
            StoreError: the index cannot be written; the frames are kept.
        """
        self._file.close()

    def _channel(self, message: Ros2Message) -> int:
        """Return the channel of a topic, which is written when it is first used."""
        topic, msgtype = message.topic, message.msgtype
        if topic not in self._channels:
            if msgtype not in self._schemas:
                definition = self._messages.definition(msgtype)
                self._schemas[msgtype] = self._file.add_schema(msgtype, "ros2msg", definition)
            service = {"offered_qos_profiles": LATCHED if topic == TRANSFORMS else ""}
            self._channels[topic] = self._file.add_channel(
                topic, "cdr", self._schemas[msgtype], service
            )
        return self._channels[topic]


def require_no_depth(views: tuple[str, ...]) -> None:
    """Refuse a view that is called as the depth map is.

    Raises:
        StoreError: there is one.
    """
    if DEPTH in map(robot_name, views):
        raise StoreError(
            f"a view is called {DEPTH}, which is the name of the depth map in topics",
            advice="give this view another name in the profile",
        )
