"""Messages of Foxglove's protobuf schemas: what a recording and a live page of Foxglove hold.

Source: the schemas of the package `foxglove-schemas-protobuf`. Pictures are not copied: the bytes
of a message are given in pieces, of which the last is the picture itself.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp
from numpy.typing import NDArray

from rig.frames import MultiView
from rig.recording.mcap_writer import Payload
from rig.recording.scene import CameraInfo, DepthImages, FrameTransform, Scene

DEPTH: Final = "depth"
"""Where topics of the depth map lie; no view may be called so."""
COLOUR: Final = "colour"
"""Topic of a view's picture in colour, beside `image`."""
_NS: Final = 1_000_000_000
_ENCODINGS: Final = {"uint8": "mono8", "uint16": "mono16", "float32": "32FC1"}
_LENSES: Final = {
    "none": "plumb_bob",
    "brown5": "plumb_bob",
    "brown8": "rational_polynomial",
    "fisheye": "kannala_brandt",
}
_BYTES: Final = 2
"""Wire type of protobuf for a field with its length before it."""


@dataclass(frozen=True, eq=False, slots=True)
class FoxgloveMessage:
    """One message and where it belongs."""

    topic: str
    schema: type[Message]
    payload: Payload

    @property
    def schema_name(self) -> str:
        """As other programs know it, `foxglove.RawImage`."""
        return self.schema.DESCRIPTOR.full_name


def messages_of(
    multiview: MultiView, time_ns: int, depth: DepthImages | None, scene: Scene
) -> Iterator[FoxgloveMessage]:
    """Yield what other programs show of one multi-view; all of one time.

    Args:
        multiview: pictures as they were taken.
        time_ns: of all messages, since 1970-01-01 UTC.
        depth: of it; None where slopes are measured only.
        scene: of the capture.
    """
    stamp = Timestamp(seconds=time_ns // _NS, nanos=time_ns % _NS)
    for frame in multiview.frames:
        frame_id = scene.frame_of[frame.view]
        yield _image(f"/{frame.view}/image", frame.image, frame_id, stamp)
        if frame.colour is not None:
            yield _image(f"/{frame.view}/{COLOUR}", frame.colour, frame_id, stamp)
        if frame.view in scene.cameras:
            camera = scene.cameras[frame.view]
            yield _calibration(f"/{frame.view}/calibration", camera, frame_id, stamp)
    if scene.transforms:
        yield _transforms(scene.transforms, stamp)
    if depth is None:
        return
    frame_id = scene.frame_of[scene.reference]
    yield _image(f"/{DEPTH}/image", depth.depth_m, frame_id, stamp)
    yield _image(f"/{DEPTH}/sigma", depth.sigma_m, frame_id, stamp)
    yield _image(f"/{DEPTH}/label", depth.label, frame_id, stamp)
    if scene.depth_camera is not None:
        yield _calibration(f"/{DEPTH}/calibration", scene.depth_camera, frame_id, stamp)
    if depth.points is not None:
        yield _cloud(f"/{DEPTH}/points", depth.points, frame_id, stamp)


def schema_of(message: type[Message]) -> bytes:
    """Return the description of a schema with all that it needs, as MCAP wants it."""
    found: dict[str, FileDescriptor] = {}
    waiting = [cast("FileDescriptor", message.DESCRIPTOR.file)]
    while waiting:
        file = waiting.pop()
        if file.name not in found:
            found[file.name] = file
            waiting.extend(cast("Any", file.dependencies))
    described = FileDescriptorSet()
    for file in found.values():
        file.CopyToProto(described.file.add())
    return described.SerializeToString()


def _image(topic: str, image: NDArray[Any], frame_id: str, stamp: Timestamp) -> FoxgloveMessage:
    height, width = image.shape[:2]
    little_endian = np.ascontiguousarray(image, image.dtype.newbyteorder("<"))
    head = RawImage(
        timestamp=stamp,
        frame_id=frame_id,
        width=width,
        height=height,
        encoding="rgb8" if image.ndim == 3 else _ENCODINGS[image.dtype.name],
        step=little_endian.nbytes // height,
    )
    field = RawImage.DATA_FIELD_NUMBER
    return FoxgloveMessage(topic, RawImage, _with_data(head, field, little_endian))


def _calibration(
    topic: str, camera: CameraInfo, frame_id: str, stamp: Timestamp
) -> FoxgloveMessage:
    message = CameraCalibration(
        timestamp=stamp,
        frame_id=frame_id,
        width=camera.width_px,
        height=camera.height_px,
        distortion_model=_LENSES[camera.lens],
        D=camera.coefficients or (0.0,) * 5,
        K=camera.matrix.ravel().tolist(),
        R=camera.rectification.ravel().tolist(),
        P=camera.projection.ravel().tolist(),
    )
    return FoxgloveMessage(topic, CameraCalibration, (message.SerializeToString(),))


def _transforms(transforms: tuple[FrameTransform, ...], stamp: Timestamp) -> FoxgloveMessage:
    message = FrameTransforms()
    for transform in transforms:
        entry = message.transforms.add()
        entry.timestamp.CopyFrom(stamp)
        entry.parent_frame_id, entry.child_frame_id = transform.parent, transform.child
        place, turn = entry.translation, entry.rotation
        place.x, place.y, place.z = transform.translation_m
        turn.x, turn.y, turn.z, turn.w = transform.quaternion
    return FoxgloveMessage("/tf", FrameTransforms, (message.SerializeToString(),))


def _cloud(
    topic: str, points: NDArray[np.float32], frame_id: str, stamp: Timestamp
) -> FoxgloveMessage:
    fields = [
        PackedElementField(name=name, offset=4 * place, type=PackedElementField.FLOAT32)
        for place, name in enumerate(("x", "y", "z", "sigma"))
    ]
    if points.shape[1] > len(fields):  # in colour
        fields += [
            PackedElementField(name=name, offset=16 + place, type=PackedElementField.UINT8)
            for place, name in enumerate(("blue", "green", "red", "alpha"))
        ]
    head = PointCloud(
        timestamp=stamp, frame_id=frame_id, point_stride=4 * points.shape[1], fields=fields
    )
    head.pose.orientation.w = 1.0
    little_endian = np.ascontiguousarray(points, "<f4")
    field = PointCloud.DATA_FIELD_NUMBER
    return FoxgloveMessage(topic, PointCloud, _with_data(head, field, little_endian))


def _with_data(head: Message, field: int, data: NDArray[Any]) -> Payload:
    """Append a field of bytes to a message: fields may stand in any order."""
    length = _varint(data.nbytes)
    tag = _varint(field << 3 | _BYTES)
    return head.SerializeToString() + tag + length, data.view(np.uint8).ravel().data


def _varint(number: int) -> bytes:
    """Seven bits a byte, the lowest first; all but the last have the eighth bit set."""
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    found.append(number)
    return bytes(found)
