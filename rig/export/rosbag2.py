"""A bag folder of ROS 2 from a capture: what the reference view saw, its depth and its camera.

Written by `rosbags` (extra `ros`) as MCAP with `metadata.yaml` of version 9. Topics and
conventions: `rig.robots.ros2_messages`; the cloud is always there.
"""

import shutil
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.errors import StoreError
from rig.export.exported import ExportedCapture
from rig.export.frame_choice import FrameChoice
from rig.live.captured import CapturedFrame, read_capture
from rig.recording import Scene
from rig.robots.depth import DepthForRobots
from rig.robots.extra import robot_extra
from rig.robots.ros2_messages import TRANSFORMS, Ros2Message, Ros2Messages
from rig.robots.scene import depth_camera_info, optical_frame, optical_transform

VIEW = "reference"
"""Name of the only view whose picture a capture folder has."""


@dataclass(frozen=True, slots=True)
class Rosbag2Export:
    """Writes the frames of a capture into one new bag, a `CaptureExporter`."""

    frames: str | None = None
    """Which frames, see `FrameChoice`; None for all."""

    def __post_init__(self) -> None:
        if self.frames is not None:
            FrameChoice.parse(self.frames)

    def export(self, source: Path, out: Path | None) -> ExportedCapture:
        """See `CaptureExporter.export`.

        Raises:
            ConfigError: the extra `ros` is not installed.
        """
        captured = read_capture(source)
        if self.frames is not None:
            captured = FrameChoice.parse(self.frames).of(captured)
        bag = out or Path(f"{source.resolve().stem}_rosbag2")
        messages = Ros2Messages()
        first = next(captured, None)
        if first is None:
            raise StoreError(f"{source}: has no frames", advice="capture again")
        scene, depth = _scene(first), DepthForRobots(first.pinhole, points=True)
        count = points = 0
        with _bag(bag, messages) as write:
            write(messages.transforms(scene, _time_ns(first)), _time_ns(first))
            for frame in _chain(first, captured):
                colour = frame.colour
                seen = depth.of(frame.depth_mm, frame.sigma_mm, frame.label, colour)
                pictures = {} if frame.image is None else {VIEW: frame.image}
                colours = {} if colour is None else {VIEW: colour}
                time_ns = _time_ns(frame)
                for message in messages.of(pictures, seen, scene, time_ns, colours):
                    write(message, time_ns)
                count += 1
                points += 0 if seen.points is None else len(seen.points)
        return ExportedCapture(bag, count, points if first.pinhole is not None else None)


def _chain(first: CapturedFrame, others: Iterator[CapturedFrame]) -> Iterator[CapturedFrame]:
    yield first
    yield from others


def _scene(frame: CapturedFrame) -> Scene:
    child = optical_frame(VIEW)
    camera = None if frame.pinhole is None else depth_camera_info(frame.pinhole)
    return Scene(
        frame_of={VIEW: child},
        reference=VIEW,
        transforms=(optical_transform(child, (0.0, 0.0, 0.0)),),
        cameras={} if camera is None else {VIEW: camera},
        depth_camera=camera,
    )


def _time_ns(frame: CapturedFrame) -> int:
    if frame.time_ns is None:
        raise StoreError(
            f"{frame.source}: frame {frame.index} has no wall-clock time, a bag needs it",
            advice="capture again: captures of now have it",
        )
    return frame.time_ns


class _Write:
    """Writes messages into an open bag; topics appear with their first message."""

    def __init__(self, writer: Any, messages: Ros2Messages) -> None:
        self._writer = writer
        self._messages = messages
        self._connections: dict[str, Any] = {}

    def __call__(self, message: Ros2Message, time_ns: int) -> None:
        if message.topic not in self._connections:
            self._connections[message.topic] = self._writer.add_connection(
                message.topic,
                message.msgtype,
                typestore=self._messages.typestore,
                offered_qos_profiles=_latched() if message.topic == TRANSFORMS else (),
            )
        self._writer.write(self._connections[message.topic], time_ns, b"".join(message.payload))


@contextmanager
def _bag(path: Path, messages: Ros2Messages) -> Generator[_Write]:
    with robot_extra("ros", "rosbags", "a bag of ROS 2"):
        # Here, because only those who ask for ROS 2 have it.
        from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: PLC0415
    if path.exists():
        raise StoreError(f"{path}: exists already", advice="name another folder with --out")
    try:
        with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            yield _Write(writer, messages)
    except BaseException as error:
        shutil.rmtree(path, ignore_errors=True)  # half a bag is none
        if isinstance(error, OSError):
            raise StoreError(
                f"{path}: cannot be written: {error.strerror}",
                advice="name another folder with --out",
            ) from error
        raise


def _latched() -> tuple[Any, ...]:
    """Quality of service of `/tf_static`: who subscribes later gets it as well."""
    from rosbags.interfaces import (  # noqa: PLC0415
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    forever = QosTime(9223372036, 854775807)
    latched = Qos(
        QosHistory.KEEP_LAST,
        1,
        QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL,
        forever,
        forever,
        QosLiveliness.AUTOMATIC,
        forever,
        avoid_ros_namespace_conventions=False,
    )
    return (latched,)
