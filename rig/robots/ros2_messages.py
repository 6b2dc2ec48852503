"""Messages of ROS 2 for one multi-view and its depth, serialised as CDR by `rosbags`.

Sources: REP 118 (depth images), REP 103 (units and frames), sensor_msgs, tf2_msgs. Pictures are not
copied: the bytes of a message are given in pieces, of which the last is the picture itself.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rig.frames import ColourImage, GreyImage
from rig.recording import CameraInfo, DepthImages, FrameTransform, Scene
from rig.recording.mcap_writer import Payload
from rig.robots.depth import whole_mm
from rig.robots.extra import robot_extra
from rig.robots.scene import rectified_info, robot_name

DEPTH: Final = "depth"
TRANSFORMS: Final = "/tf_static"
_NS: Final = 1_000_000_000
_CAMERA_INFO: Final = "sensor_msgs/msg/CameraInfo"
_IMAGE: Final = "sensor_msgs/msg/Image"
_CLOUD: Final = "sensor_msgs/msg/PointCloud2"
_TRANSFORMS: Final = "tf2_msgs/msg/TFMessage"
_LENSES: Final = {
    "none": "plumb_bob",
    "brown5": "plumb_bob",
    "brown8": "rational_polynomial",
    "fisheye": "equidistant",
}
_ENCODINGS: Final = {"uint8": "mono8", "uint16": "mono16", "float32": "32FC1"}
_FLOAT32: Final = 7
"""`sensor_msgs/PointField.FLOAT32`."""


@dataclass(frozen=True, eq=False, slots=True)
class Ros2Message:
    """One message and where it belongs."""

    topic: str
    msgtype: str
    payload: Payload


class Ros2Messages:
    """Makes the messages of one capture; two topics of the same name there are none.

    Raises:
        ConfigError: the extra `ros` is not installed.
    """

    def __init__(self) -> None:
        with robot_extra("ros", "rosbags", "messages of ROS 2"):
            # Here, because only those who ask for ROS 2 have it.
            from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415
        self.typestore: Any = get_typestore(Stores.ROS2_JAZZY)
        self._types: Mapping[str, Any] = self.typestore.types

    def definition(self, msgtype: str) -> bytes:
        """Return the definition of a type with all that it needs, as `ros2msg`."""
        text, _ = self.typestore.generate_msgdef(msgtype, ros_version=2)
        return str(text).encode()

    def transforms(self, scene: Scene, time_ns: int) -> Ros2Message:
        """Return where the optical frames stand, for `/tf_static`."""
        listed = [self._transform(transform, time_ns) for transform in scene.transforms]
        message = self._types[_TRANSFORMS](transforms=listed)
        return Ros2Message(TRANSFORMS, _TRANSFORMS, (self._cdr(message, _TRANSFORMS),))

    def of(
        self,
        pictures: Mapping[str, GreyImage],
        depth: DepthImages | None,
        scene: Scene,
        time_ns: int,
        colours: Mapping[str, ColourImage] | None = None,
    ) -> Iterator[Ros2Message]:
        """Yield the messages of one multi-view; all of one time.

        Args:
            pictures: rectified, by view.
            depth: of the reference view; None where slopes are measured only.
            scene: of the capture.
            time_ns: mid-exposure, since 1970-01-01 UTC.
            colours: rectified, of the views that have colour; None where none has.
        """
        for view, picture in pictures.items():
            frame_id, name = scene.frame_of[view], robot_name(view)
            yield self._image(f"/{name}/image_rect", picture, frame_id, time_ns)
            if colours is not None and view in colours:
                yield self._image(f"/{name}/image_rect_color", colours[view], frame_id, time_ns)
            camera = _camera_of(picture.shape, scene.cameras.get(view))
            yield self._camera_info(f"/{name}", camera, picture.shape, frame_id, time_ns)
        if depth is None:
            return
        frame_id = scene.frame_of[scene.reference]
        raw = whole_mm(depth.depth_m)
        yield self._image(f"/{DEPTH}/image", depth.depth_m, frame_id, time_ns)
        yield self._image(f"/{DEPTH}/image_raw", raw, frame_id, time_ns, encoding="16UC1")
        yield self._image(f"/{DEPTH}/sigma", depth.sigma_m, frame_id, time_ns)
        camera = scene.depth_camera
        yield self._camera_info(f"/{DEPTH}", camera, depth.depth_m.shape, frame_id, time_ns)
        if depth.points is not None:
            yield self._cloud(f"/{DEPTH}/points", depth.points, frame_id, time_ns)

    def _header(self, frame_id: str, time_ns: int) -> Any:
        stamp = self._types["builtin_interfaces/msg/Time"](
            sec=time_ns // _NS, nanosec=time_ns % _NS
        )
        return self._types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame_id)

    def _image(
        self,
        topic: str,
        image: NDArray[Any],
        frame_id: str,
        time_ns: int,
        *,
        encoding: str | None = None,
    ) -> Ros2Message:
        height, width = image.shape[:2]
        little_endian = np.ascontiguousarray(image, image.dtype.newbyteorder("<"))
        empty = self._types[_IMAGE](
            header=self._header(frame_id, time_ns),
            height=height,
            width=width,
            encoding=encoding or ("rgb8" if image.ndim == 3 else _ENCODINGS[image.dtype.name]),
            is_bigendian=0,
            step=little_endian.nbytes // height,
            data=np.zeros(0, np.uint8),
        )
        # The data are the last field: their count, here of none, and then the bytes.
        head = self._cdr(empty, _IMAGE)[:-4] + struct.pack("<I", little_endian.nbytes)
        return Ros2Message(topic, _IMAGE, (head, little_endian.view(np.uint8).ravel().data))

    def _camera_info(
        self,
        folder: str,
        camera: CameraInfo | None,
        shape: tuple[int, ...],
        frame_id: str,
        time_ns: int,
    ) -> Ros2Message:
        """By the convention of ROS a camera that is not calibrated has a matrix of zeros."""
        height, width = shape if camera is None else (camera.height_px, camera.width_px)
        message = self._types[_CAMERA_INFO](
            header=self._header(frame_id, time_ns),
            height=height,
            width=width,
            distortion_model="" if camera is None else _LENSES[camera.lens],
            d=np.array([] if camera is None else camera.coefficients or [0.0] * 5),
            k=np.zeros(9) if camera is None else camera.matrix.ravel(),
            r=np.zeros(9) if camera is None else camera.rectification.ravel(),
            p=np.zeros(12) if camera is None else camera.projection.ravel(),
            binning_x=0,
            binning_y=0,
            roi=self._types["sensor_msgs/msg/RegionOfInterest"](
                x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
            ),
        )
        payload = (self._cdr(message, _CAMERA_INFO),)
        return Ros2Message(f"{folder}/camera_info", _CAMERA_INFO, payload)

    def _cloud(
        self, topic: str, points: NDArray[np.float32], frame_id: str, time_ns: int
    ) -> Ros2Message:
        count = len(points)
        fields = [
            self._types["sensor_msgs/msg/PointField"](
                name=name, offset=4 * place, datatype=_FLOAT32, count=1
            )
            for place, name in enumerate(("x", "y", "z", "sigma", "rgb")[: points.shape[1]])
        ]
        empty = self._types[_CLOUD](
            header=self._header(frame_id, time_ns),
            height=1,
            width=count,
            fields=fields,
            is_bigendian=False,
            point_step=4 * points.shape[1],
            row_step=4 * points.shape[1] * count,
            data=np.zeros(0, np.uint8),
            is_dense=True,
        )
        data = np.ascontiguousarray(points, "<f4").view(np.uint8).ravel().data
        # Behind the data there is one byte more: whether the cloud is dense.
        whole = self._cdr(empty, _CLOUD)
        head, dense = whole[:-5] + struct.pack("<I", len(data)), whole[-1:]
        return Ros2Message(topic, _CLOUD, (head, data, dense))

    def _transform(self, transform: FrameTransform, time_ns: int) -> Any:
        x, y, z = transform.translation_m
        qx, qy, qz, qw = transform.quaternion
        types = self._types
        return types["geometry_msgs/msg/TransformStamped"](
            header=self._header(transform.parent, time_ns),
            child_frame_id=transform.child,
            transform=types["geometry_msgs/msg/Transform"](
                translation=types["geometry_msgs/msg/Vector3"](x=x, y=y, z=z),
                rotation=types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw),
            ),
        )

    def _cdr(self, message: Any, msgtype: str) -> bytes:
        return bytes(self.typestore.serialize_cdr(message, msgtype))


def _camera_of(shape: tuple[int, ...], camera: CameraInfo | None) -> CameraInfo | None:
    """Return the camera of a rectified picture (H, W), or of the raw one where sizes are equal.

    Programs take size and P of one message for the picture beside it. Where cameras are unlike,
    rectified pictures are as large as the reference's, and K and D of a raw picture do not fit.
    """
    height_px, width_px = shape[:2]
    if camera is None or (camera.width_px, camera.height_px) == (width_px, height_px):
        return camera
    return rectified_info((width_px, height_px), camera.projection)
