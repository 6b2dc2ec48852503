"""The recording of a capture: its multi-views as they were taken, and their depth beside them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from rig.capture.output import Output
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.recording import RecordingWriter
from rig.robots.frames import RobotFrames


class CaptureRecording:
    """Records every multi-view that is measured.

    Args:
        path: must not exist.
        camera: open.
        points: whether to record the cloud as well.

    Raises:
        StoreError: the file exists or cannot be written.
    """

    name = "recording"

    def __init__(self, path: Path, camera: DepthCamera, *, points: bool = False) -> None:
        self._frames = RobotFrames(camera.run, points=points)
        self._writer = RecordingWriter(path, camera.views, camera.identity)

    def write(self, frame: DepthFrame) -> None:
        """Append one multi-view.

        Raises:
            StoreError: the disk is full or gone.
        """
        seen = self._frames.of(frame)
        self._writer.write(frame.views, frame.time_ns, seen.depth, seen.scene)

    def close(self) -> None:
        """End the file.

        Raises:
            StoreError: the disk is full or gone.
        """
        self._writer.close()


def _ros2(path: Path, camera: DepthCamera, points: bool) -> Output:
    from rig.robots.ros2_recording import Ros2Recording  # noqa: PLC0415  (an extra)

    return Ros2Recording(path, camera, points=points)


RECORDINGS: Final[Mapping[str, Callable[[Path, DepthCamera, bool], Output]]] = {
    "foxglove": lambda path, camera, points: CaptureRecording(path, camera, points=points),
    "ros2": _ros2,
}
"""What a recording can be, and what opens it: a new file, the opened camera, whether the cloud is
wanted."""
