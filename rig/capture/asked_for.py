"""What a person asks for while a capture runs: a frame to be kept, a recording begun and ended."""

import threading
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from rig.capture.folder import CaptureFolder
from rig.capture.recording import CaptureRecording
from rig.errors import StoreError
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame


def _utc() -> datetime:
    return datetime.now(UTC)


class AskedFor:
    """Keeps single frames, and records from start to stop; an output, and safe from any thread.

    Args:
        folder: where it all goes; made when something is asked for.
        camera: open.
        utc: names recordings.
    """

    name = "asked-for"

    def __init__(
        self, folder: Path, camera: DepthCamera, utc: Callable[[], datetime] = _utc
    ) -> None:
        self._folder = folder
        self._camera = camera
        self._utc = utc
        self._lock = threading.Lock()
        self._files: CaptureFolder | None = None
        self._recording: CaptureRecording | None = None
        self._path = folder
        self._recorded = 0
        self._is_closed = False

    @property
    def is_recording(self) -> bool:
        """Whether a recording runs."""
        return self._recording is not None

    def save(self, frame: DepthFrame) -> str:
        """Write all maps of one frame, as `rig capture --out` does; return one line about it.

        Raises:
            StoreError: the folder cannot be written, or the capture has ended.
        """
        with self._lock:
            self._require_open()
            if self._files is None:
                self._files = CaptureFolder(self._folder, self._camera.run)
            self._files.write(frame)
        return f"frame {frame.index} is in {self._folder}"

    def start_recording(self) -> str:
        """Record every multi-view from now on into a new file; return one line about it.

        Raises:
            StoreError: the file cannot be written, or the capture has ended.
        """
        with self._lock:
            self._require_open()
            if self._recording is None:
                self._path = self._folder / f"recording_{self._utc():%Y%m%d-%H%M%S}.mcap"
                self._make_folder()
                self._recording = CaptureRecording(self._path, self._camera)
                self._recorded = 0
            return f"recording into {self._path}"

    def stop_recording(self) -> str:
        """End the recording, if one runs; return one line about it.

        Raises:
            StoreError: its end cannot be written.
        """
        with self._lock:
            return self._end_recording()

    def write(self, frame: DepthFrame) -> None:
        """Record one multi-view, where a recording runs.

        Raises:
            StoreError: the disk is full or gone.
        """
        with self._lock:
            if self._recording is not None:
                self._recording.write(frame)
                self._recorded += 1

    def close(self) -> None:
        """End the recording, and close what was kept.

        Raises:
            StoreError: what was written is not whole.
        """
        with self._lock:
            self._is_closed = True
            try:
                self._end_recording()
            finally:
                files, self._files = self._files, None
                if files is not None:
                    files.close()

    def _end_recording(self) -> str:
        recording, self._recording = self._recording, None
        if recording is None:
            return "nothing is being recorded"
        recording.close()
        return f"{self._recorded} multi-views are in {self._path}"

    def _make_folder(self) -> None:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(
                f"capture folder {self._folder}: cannot be written: {error.strerror}",
                advice="choose another one with --out",
            ) from error

    def _require_open(self) -> None:
        if self._is_closed:
            raise StoreError(
                f"asked to write into {self._folder}, but the capture has ended",
                advice="start it again",
            )
