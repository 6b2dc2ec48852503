"""Calibrations as tools write them that `rig` only reads; by the formats' definitions alone."""

import json
import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rig.geometry.camera_model import CameraModel
from rig.geometry.rig_geometry import RigGeometry

_COLMAP = {"none": (1, 4), "brown5": (6, 12), "brown8": (6, 12), "fisheye": (5, 8)}
_ZED = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")


def caliscope(geometry: RigGeometry, *, old: bool = False) -> str:
    """A camera array, lengths in m; old ones hold matrices, and tables on the top level."""
    lines: list[str] = ['CreationDate = "2023-03-31"'] if old else []
    for number, (camera, pose) in enumerate(
        zip(geometry.cameras, geometry.cam_from_reference, strict=True)
    ):
        turn = pose.rotation if old else Rotation.from_matrix(pose.rotation).as_rotvec()
        lines += [
            f"[cam_{number}]" if old else f"[cameras.{number}]",
            f"{'port' if old else 'cam_id'} = {number}",
            "rotation_count = -1",
            "ignore = false",
            f"size = [{camera.width_px}, {camera.height_px}]",
            f"matrix = {camera.matrix.tolist()}",
            f"distortions = {list(camera.coefficients or [0.0] * 5)}",
            f"rotation = {np.asarray(turn).tolist()}",
            f"translation = {(pose.translation_mm / 1000.0).tolist()}",
            f"fisheye = {'true' if camera.lens == 'fisheye' else 'false'}",
        ]
    return "\n".join([*lines, "[charuco]", "columns = 4", ""])


def zed(left: CameraModel, geometry: RigGeometry, size: str = "HD") -> str:
    """The configuration of a device whose right camera is view 1 of a pair."""
    pose = geometry.cam_from_reference[1]
    rx, cv, rz = Rotation.from_matrix(pose.rotation).as_rotvec().tolist()
    x, y, z = pose.translation_mm.tolist()
    lines = [
        *_zed_camera(f"LEFT_CAM_{size}", left),
        *_zed_camera(f"RIGHT_CAM_{size}", geometry.cameras[1]),
        "[STEREO]", f"Baseline={-x!r}", f"TY={y!r}", f"TZ={z!r}", f"CV_{size}={cv!r}",
        f"RX_{size}={rx!r}", f"RZ_{size}={rz!r}", "[MISC]", "Sensor_ID=0", "",
    ]  # fmt: skip
    return "\n".join(lines)


def _zed_camera(section: str, camera: CameraModel) -> list[str]:
    coefficients = list(camera.coefficients)
    if camera.lens == "fisheye":
        coefficients = [*coefficients[:2], 0.0, 0.0, *coefficients[2:]]
    return [
        f"[{section}]",
        *(f"{name}={getattr(camera, f'{name}_px')!r}" for name in ("fx", "fy", "cx", "cy")),
        *(f"{name}={value!r}" for name, value in zip(_ZED, coefficients, strict=False)),
        "",
    ]


def colmap_binary(geometry: RigGeometry, folder: Path, points: int = 2) -> None:
    """`cameras.bin` and `images.bin`, with some points that no rig needs."""
    cameras = [struct.pack("<Q", len(geometry.names))]
    images = list(cameras)
    for number, (name, camera, pose) in enumerate(
        zip(geometry.names, geometry.cameras, geometry.cam_from_reference, strict=True), start=7
    ):
        model, count = _COLMAP[camera.lens]
        numbers = [
            camera.fx_px, camera.fy_px, camera.cx_px + 0.5, camera.cy_px + 0.5,
            *camera.coefficients,
        ]  # fmt: skip
        numbers += [0.0] * (count - len(numbers))
        size = (camera.width_px, camera.height_px)
        cameras.append(struct.pack(f"<IiQQ{count}d", number, model, *size, *numbers))
        x, y, z, w = Rotation.from_matrix(pose.rotation).as_quat().tolist()
        moved_m = (pose.translation_mm / 1000.0).tolist()
        images.append(struct.pack("<I7dI", 20 + number, w, x, y, z, *moved_m, number))
        images.append(f"{name}.png".encode() + b"\0" + struct.pack("<Q", points))
        images.append(struct.pack("<ddq", 1.5, 2.5, -1) * points)
    (folder / "cameras.bin").write_bytes(b"".join(cameras))
    (folder / "images.bin").write_bytes(b"".join(images))


def mrcal(camera: CameraModel, model: str, rt: list[float]) -> str:
    """One camera model, with the large literal that mrcal itself adds."""
    numbers = [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.coefficients]
    return (
        "# generated\n{\n"
        f"    'lensmodel':  '{model}',\n    'intrinsics': {json.dumps(numbers)},\n"
        f"    'valid_intrinsics_region': [[0, 0], [9, 0], [9, 9], [0, 0]],\n"
        f"    'extrinsics': {json.dumps(rt)},\n"
        f"    'imagersize': [{camera.width_px}, {camera.height_px}],\n"
        "    'icam_intrinsics': 0,\n    'optimization_inputs': b'P*s(){}#,.',\n}\n"
    )
