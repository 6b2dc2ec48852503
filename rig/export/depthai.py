"""DepthAI EEPROM JSON, as `CalibrationHandler` reads and writes it.

Cameras are known by their sockets; lengths in cm (or as `lengthUnit` says); each camera's
extrinsics take its points into those of another socket. Device calibrations hold more (IMU, board,
options): an export starts from the device's own file where one is given, and touches the cameras
only.
DepthAI keeps numbers in single precision.
"""

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import cast

import numpy as np

from rig.errors import FormatError
from rig.export import fields, oak_gen1
from rig.export.opencv_lens import fisheye_lens, opencv_lens
from rig.export.seen_from_one import seen_from_one
from rig.files import read_bytes, write_bytes
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_SOCKET = re.compile(r"^CAM_([A-J])$")
_PERSPECTIVE, _FISHEYE = 0, 1
_MM_PER_UNIT = {0: 1000.0, 1: 10.0, 2: 1.0}
"""By `lengthUnit`: metre, centimetre, millimetre."""
_COEFFICIENTS = 14
_VERSION = 7


def write(
    geometry: RigGeometry,
    path: Path,
    *,
    sockets: Mapping[str, str] | None = None,
    device: Path | None = None,
) -> None:
    """Write the calibration of one device.

    Args:
        geometry: views of one device.
        path: file to write.
        sockets: by view name: `CAM_A` and so on; views may also be called like their sockets.
        device: the device's own EEPROM JSON, whose other contents are kept.

    Raises:
        FormatError: a view has no socket, or `device` is no EEPROM JSON.
        StoreError: a file cannot be read or written.
    """
    numbers = [_socket((sockets or {}).get(name, name), name) for name in geometry.names]
    if len(set(numbers)) != len(numbers):
        raise FormatError("two views have the same socket", advice="name one socket per view")
    content: dict[str, object] = (
        dict(fields.read_json(device)) if device is not None else _EMPTY.copy()
    )
    reference = numbers[geometry.reference]
    content["cameraData"] = [
        [
            number,
            {
                "cameraType": _FISHEYE if camera.lens == "fisheye" else _PERSPECTIVE,
                "distortionCoeff": _padded(camera),
                "extrinsics": _extrinsics(pose, -1 if number == reference else reference),
                "height": camera.height_px,
                "width": camera.width_px,
                "intrinsicMatrix": camera.matrix.tolist(),
                "lensPosition": 0,
                "specHfovDeg": float(
                    np.degrees(2.0 * np.arctan(0.5 * camera.width_px / camera.fx_px))
                ),
            },
        ]
        for number, camera, pose in zip(
            numbers, geometry.cameras, geometry.cam_from_reference, strict=True
        )
    ]
    write_bytes(path, (json.dumps(content, indent=2) + "\n").encode())


def read(path: Path) -> RigGeometry:
    """Read all calibrated cameras of a device; views are called after their sockets.

    The reference is the camera that the others' extrinsics end at. Sockets without intrinsics are
    left out. The binary file of the first generation is read by `rig.export.oak_gen1`.

    Raises:
        FormatError: it is no EEPROM JSON, or its extrinsics do not reach one camera.
        StoreError: it cannot be read.
    """
    if len(start := read_bytes(path, most=oak_gen1.BYTES)) == oak_gen1.BYTES and b"\0" in start:
        return oak_gen1.read(path)
    cameras: dict[int, CameraModel] = {}
    steps: dict[int, tuple[int, Pose]] = {}
    for number, data in _entries(path):
        where = f"{path}: {_name(number)}"
        is_calibrated = _is_calibrated(data)
        if is_calibrated:
            cameras[number] = _camera(data, where)
        step = _step(data, where, must_tell=is_calibrated)
        if step is not None:
            steps[number] = step
    if not cameras:
        raise FormatError(
            f"{path}: holds no camera with intrinsics",
            advice="calibrate the device, or give what its factory wrote",
        )
    known = sorted(cameras.keys() | {target for target, _ in steps.values()})
    roots = [number for number in known if number not in steps]
    if len(roots) != 1:
        raise FormatError(
            f"{path}: the extrinsics of {len(cameras)} cameras end at {len(roots)} of them, "
            "expected 1",
            advice="calibrate the device as a whole",
        )
    order = sorted(cameras)
    return seen_from_one(
        [_name(number) for number in order],
        [cameras[number] for number in order],
        [_to_root(number, roots[0], steps, path) for number in order],
    )


def _entries(path: Path) -> Iterator[tuple[int, fields.Fields]]:
    """Socket and calibration of every camera of a file."""
    content = fields.read_json(path)
    entries = content.get("cameraData")
    if not isinstance(entries, list):
        is_board = any(name in content for name in ("boardName", "boardConf", "board_config"))
        what = "describes a board of DepthAI without a calibration: it " if is_board else ""
        raise FormatError(
            f"{path}: {what}has no list cameraData",
            advice="give what the device itself holds, as DepthAI writes it (eepromToJsonFile)",
        )
    for entry in cast("list[object]", entries):
        if not isinstance(entry, list) or len(cast("list[object]", entry)) != 2:
            raise FormatError(f"{path}: cameraData must hold pairs of socket and calibration")
        key, value = cast("list[object]", entry)
        number = int(fields.number(key, f"{path}: socket"))
        yield number, fields.mapping(value, f"{path}: {_name(number)}")


def _is_calibrated(data: fields.Fields) -> bool:
    """Whether a socket has intrinsics; devices list those without as empty or as zeros."""
    matrix = data.get("intrinsicMatrix", [[1.0]])  # a missing one is told as missing
    if not isinstance(matrix, list):
        return True
    rows = cast("list[object]", matrix)
    return any(row != [0.0, 0.0, 0.0] for row in rows)


def _socket(socket: str, view: str) -> int:
    known = _SOCKET.match(socket)
    if known is None:
        raise FormatError(
            f"view {view}: has no DepthAI socket",
            advice=f"give it with --socket {view}=CAM_A (or B, C, ...)",
        )
    return ord(known.group(1)) - ord("A")


def _name(number: int) -> str:
    return f"CAM_{chr(ord('A') + number)}" if 0 <= number < 10 else f"socket {number}"


def _padded(camera: CameraModel) -> list[float]:
    return [*camera.coefficients, *[0.0] * (_COEFFICIENTS - len(camera.coefficients))]


def _extrinsics(pose: Pose, target: int) -> dict[str, object]:
    back = pose.inverse()
    translation = dict(zip("xyz", (back.translation_mm / _MM_PER_UNIT[1]).tolist(), strict=True))
    return {
        "lengthUnit": 1,
        "rotationMatrix": [] if target < 0 else back.rotation.tolist(),
        "specTranslation": translation,
        "toCameraSocket": target,
        "toDeviceId": "",
        "translation": translation,
    }


def _camera(data: fields.Fields, where: str) -> CameraModel:
    matrix = fields.matrix(fields.field(data, "intrinsicMatrix", where), (3, 3), where)
    coefficients = fields.numbers(fields.field(data, "distortionCoeff", where), where)
    fields.require_no_skew(matrix, f"{where} intrinsicMatrix")
    kind = int(fields.number(data.get("cameraType", _PERSPECTIVE), where))
    if kind == _FISHEYE and len(coefficients) >= 4:
        lens, used = fisheye_lens(coefficients, where)
    elif kind == _PERSPECTIVE and len(coefficients) >= 8:
        lens, used = opencv_lens(coefficients, where)
    else:
        raise FormatError(
            f"{where}: camera type {kind} with {len(coefficients)} coefficients is not known here",
            advice=f"known are {_PERSPECTIVE} (perspective, 8 or 14) and {_FISHEYE} (fisheye, 4)",
        )
    width, height = (
        fields.size_px(fields.field(data, n, where), where) for n in ("width", "height")
    )
    intrinsics = fields.four([*matrix[[0, 1], [0, 1]].tolist(), *matrix[:2, 2].tolist()], where)
    return fields.camera((width, height), intrinsics, lens, used, where)


def _step(data: fields.Fields, where: str, *, must_tell: bool) -> tuple[int, Pose] | None:
    """Where a camera's extrinsics lead, and how; None for one at which others end."""
    if not must_tell and not data.get("extrinsics"):
        return None
    extrinsics = fields.mapping(fields.field(data, "extrinsics", where), where)
    target = int(fields.number(fields.field(extrinsics, "toCameraSocket", where), where))
    if target < 0:
        return None
    unit = int(fields.number(extrinsics.get("lengthUnit", 1), where))
    if unit not in _MM_PER_UNIT:
        raise FormatError(f"{where}: length unit {unit} is not known here")
    given = fields.mapping(fields.field(extrinsics, "translation", where), where)
    translation_mm = [
        _MM_PER_UNIT[unit] * fields.number(fields.field(given, axis, where), where)
        for axis in "xyz"
    ]
    rotation = fields.matrix(fields.field(extrinsics, "rotationMatrix", where), (3, 3), where)
    return target, fields.pose(rotation, translation_mm, where)


def _to_root(number: int, root: int, steps: dict[int, tuple[int, Pose]], path: Path) -> Pose:
    """Pose of a camera relative to the root: cam_from_root."""
    root_from_cam = Pose.identity()
    here, seen = number, {number}
    while here != root:
        target, step = steps.get(here, (root, Pose.identity()))
        root_from_cam = step @ root_from_cam
        if target in seen:
            raise FormatError(f"{path}: the extrinsics of {_name(number)} go round in a circle")
        seen.add(target)
        here = target
    return root_from_cam.inverse() if number != root else root_from_cam


_EMPTY: dict[str, object] = {
    "batchName": "", "batchTime": 0, "boardConf": "", "boardCustom": "", "boardName": "",
    "boardOptions": 0, "boardRev": "", "deviceName": "", "hardwareConf": "",
    "miscellaneousData": [], "productName": "", "stereoEnableDistortionCorrection": False,
    "stereoRectificationData": {
        "leftCameraSocket": -1, "rectifiedRotationLeft": [], "rectifiedRotationRight": [],
        "rightCameraSocket": -1,
    },
    "stereoUseSpecTranslation": False, "version": _VERSION, "verticalCameraSocket": -1,
}  # fmt: skip
