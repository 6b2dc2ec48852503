"""Recordings of multi-views with their depth, as MCAP files that other programs show too.

Pictures, calibrations, depth and transforms are messages of Foxglove's protobuf schemas. Beside
them the channel `/multi_view` (schema `rig.MultiView`, JSON) holds what the schemas do not: it
makes what is played back equal to what was taken. A multi-view counts only with that message, which
is the last of its chunk; a chunk is one multi-view and written through, so that a file that was cut
off ends with the last whole multi-view.

Sources: the MCAP specification; Foxglove's schemas.
"""

from rig.recording.reader import Recorded, recorded, recorded_views
from rig.recording.scene import CameraInfo, DepthImages, FrameTransform, Scene
from rig.recording.writer import RecordingWriter

__all__ = [
    "CameraInfo",
    "DepthImages",
    "FrameTransform",
    "Recorded",
    "RecordingWriter",
    "Scene",
    "recorded",
    "recorded_views",
]
