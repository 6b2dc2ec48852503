"""Stored pictures as two kinds of camera: a folder of files, and a recording."""

from pathlib import Path

from rig.devices import Camera
from rig.profile import FolderCameraConfig, RecordingCameraConfig
from rig.profile.kinds import CameraKind, Surroundings


def _open_folder(config: FolderCameraConfig, around: Surroundings) -> Camera:
    from rig_drivers.stored.folder import FolderCamera

    return FolderCamera(config, around.views, root=Path(config.folder), clock=around.clock)


def _open_recording(config: RecordingCameraConfig, around: Surroundings) -> Camera:
    from rig_drivers.stored.recording import ReplayCamera

    return ReplayCamera(config, around.views, around.clock)


FOLDER = CameraKind(contract=1, name="folder", config=FolderCameraConfig, open=_open_folder)
RECORDING = CameraKind(
    contract=1, name="recording", config=RecordingCameraConfig, open=_open_recording
)
