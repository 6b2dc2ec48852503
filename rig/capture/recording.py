"""The recording of a capture: its multi-views as they were taken."""

from pathlib import Path

from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.recording import RecordingWriter


class CaptureRecording:
    """Records every multi-view that is measured.

    Args:
        path: must not exist.
        camera: open.

    Raises:
        StoreError: the file exists or cannot be written.
    """

    name = "recording"

    def __init__(self, path: Path, camera: DepthCamera) -> None:
        self._writer = RecordingWriter(path, camera.views, camera.identity)

    def write(self, frame: DepthFrame) -> None:
        """Append one multi-view.

        Raises:
            StoreError: the disk is full or gone.
        """
        self._writer.write(frame.views)

    def close(self) -> None:
        """End the file.

        Raises:
            StoreError: the disk is full or gone.
        """
        self._writer.__exit__()
