"""Calibrations as other tools write them and rig does not: valid files by the formats alone."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import yaml

from benchmarks.fuzz.geometry import lens_of, some_of
from rig.arrays import Float
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.rig_geometry import RigGeometry
from tests.support import foreign_files

Write = Callable[[RigGeometry, Path], Path]
"""Takes five cameras and an empty folder; returns the place to read."""


def _text(name: str, text: Callable[[RigGeometry], str]) -> Write:
    def write(geometry: RigGeometry, folder: Path) -> Path:
        (folder / name).write_text(text(geometry))
        return folder / name

    return write


def _pair(geometry: RigGeometry, lens: LensModel = "brown5") -> RigGeometry:
    return lens_of(some_of(geometry, 2), lens)


def _zed_of_two_sizes(geometry: RigGeometry) -> str:
    pair = _pair(geometry)
    small = [replace(camera, width_px=672, height_px=376) for camera in pair.cameras]
    one = foreign_files.zed(pair.cameras[0], pair)
    other = foreign_files.zed(small[0], replace(pair, cameras=tuple(small)), "VGA")
    return other + one.replace("[MISC]\nSensor_ID=0\n", "")


def _zed_of_one(geometry: RigGeometry) -> str:
    told = foreign_files.zed(geometry.cameras[0], geometry)
    return told.replace("RIGHT_CAM", "OTHER")


def _zed_of_unknown_size(geometry: RigGeometry) -> str:
    return foreign_files.zed(geometry.cameras[0], geometry, "4K")


def _caliscope_with_one_ignored(geometry: RigGeometry) -> str:
    told = foreign_files.caliscope(some_of(geometry, 3))
    return "ignore = true".join(told.rsplit("ignore = false", 1))


def _kalibr_by_imu(geometry: RigGeometry) -> str:
    chain: dict[str, object] = {}
    for number, camera in enumerate(geometry.cameras[:2]):
        turn = np.eye(4)
        turn[:3, 3] = (0.05 * number, 0.01, 0.0)
        chain[f"cam{number}"] = {
            "T_cam_imu": turn.tolist(),
            "camera_model": "pinhole",
            "distortion_model": "radtan",
            "distortion_coeffs": [0.01, -0.02, 0.001, 0.0],
            "intrinsics": [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px],
            "resolution": [camera.width_px, camera.height_px],
            "rostopic": f"/cam{number}/image_raw",
        }
    return yaml.safe_dump(chain, default_flow_style=None)


def _stored(values: Float) -> dict[str, object]:
    """A matrix as FileStorage writes it into JSON."""
    rows, columns = values.shape
    data = values.ravel().tolist()
    return {"type_id": "opencv-matrix", "rows": rows, "cols": columns, "dt": "d", "data": data}


def _row(camera: CameraModel) -> Float:
    return np.array([camera.coefficients or (0.0,) * 5])


def _pair_in_one(names: Sequence[str], lens: LensModel = "brown5") -> Callable[[RigGeometry], str]:
    def text(geometry: RigGeometry) -> str:
        one, two = _pair(geometry, lens).cameras
        matrices = (one.matrix, _row(one), two.matrix, _row(two))
        content = {name: _stored(matrix) for name, matrix in zip(names, matrices, strict=True)}
        content["R"] = _stored(np.eye(3) if "FE" in names[1] else np.zeros((3, 1)))
        content["T"] = _stored(np.array([[-40.0], [0.0], [0.0]]))
        return json.dumps(content)

    return text


def _opencv_alone(
    names: tuple[str, str], told: Mapping[str, object], lens: LensModel = "brown5"
) -> Callable[[RigGeometry], str]:
    def text(geometry: RigGeometry) -> str:
        camera = lens_of(some_of(geometry, 1), lens).cameras[0]
        matrices = {names[0]: _stored(camera.matrix), names[1]: _stored(_row(camera))}
        return json.dumps({**matrices, **told})

    return text


def _opencv_many(geometry: RigGeometry) -> str:
    """All views by JSON, as `rig.yml` has them."""
    views: list[dict[str, object]] = []
    kinds: Sequence[tuple[LensModel, str]] = (
        ("none", "centre"),
        ("brown8", "right"),
        ("fisheye", "other"),
    )
    for lens, name in kinds:
        camera = lens_of(some_of(geometry, 1), lens).cameras[0]
        views.append({
            "name": name, "image_width": 640, "image_height": 400, "distortion_model": lens,
            "camera_matrix": _stored(camera.matrix), "rotation": _stored(np.eye(3)),
            "distortion_coefficients": _stored(_row(camera)),
            "translation_mm": _stored(np.zeros((3, 1))),
        })  # fmt: skip
    return json.dumps({"reference": "centre", "views": views})


def _opencv_pair(suffix: str) -> Write:
    """The two files of the stereo sample."""

    def write(geometry: RigGeometry, folder: Path) -> Path:
        one, two = _pair(geometry).cameras
        inside = {"M1": one.matrix, "D1": _row(one), "M2": two.matrix, "D2": _row(two)}
        outside = {"R": np.eye(3), "T": np.array([[-40.0], [0.0], [0.0]])}
        for name, matrices in (("intrinsics", inside), ("extrinsics", outside)):
            path = folder / f"{name}{suffix}"
            storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
            for key, matrix in matrices.items():
                storage.write(key, matrix)
            storage.release()
        return folder if suffix == ".yml" else folder / f"intrinsics{suffix}"

    return write


def _depthai(geometry: RigGeometry) -> str:
    """Two cameras, a fisheye in cm and a socket without a camera."""
    entries: list[list[object]] = []
    for number, lens in enumerate(("brown8", "fisheye", "brown8")):
        camera = lens_of(some_of(geometry, 1), lens).cameras[0]
        numbers = [*camera.coefficients, *[0.0] * (14 - len(camera.coefficients))]
        is_last = number == 2
        shift = dict(zip("xyz", (4.0 * number, 0.0, 0.0), strict=True))
        entries.append([number, {
            "cameraType": int(lens == "fisheye"), "width": 640, "height": 400,
            "distortionCoeff": numbers, "intrinsicMatrix": camera.matrix.tolist(),
            "extrinsics": {
                "lengthUnit": 0 if number else 1, "toCameraSocket": -1 if is_last else number + 1,
                "rotationMatrix": [] if is_last else np.eye(3).tolist(), "translation": shift,
            },
        }])  # fmt: skip
    empty = {"intrinsicMatrix": [[0.0] * 3] * 3, "extrinsics": {}}
    return json.dumps({"boardName": "X", "cameraData": [*entries, [3, empty], [4, {}]]})


def _depthai_board(_: RigGeometry) -> str:
    return json.dumps({"board_config": {"name": "X", "cameras": {"CAM_A": {"hfov": 68.8}}}})


def _depthai_of_old(geometry: RigGeometry, folder: Path) -> Path:
    """The 111 numbers of the first generation."""
    matrix = geometry.cameras[0].matrix.ravel().tolist()
    turn, shift = np.eye(3).ravel().tolist(), [7.5, 0.0, 0.0]
    lens = [0.01, -0.02, 0.001, 0.001, 0.0, *[0.0] * 9]
    numbers = [*turn, *turn, *matrix, *matrix, *turn, *shift, *matrix, *turn, *shift, *lens * 3]
    (folder / "depthai.calib").write_bytes(np.array(numbers, "<f4").tobytes())
    return folder / "depthai.calib"


def _mrcal(geometry: RigGeometry, folder: Path) -> Path:
    kinds: Sequence[tuple[str, str, LensModel]] = (
        ("centre", "LENSMODEL_OPENCV8", "brown8"),
        ("right", "LENSMODEL_PINHOLE", "none"),
    )
    for number, (name, model, lens) in enumerate(kinds):
        camera = lens_of(some_of(geometry, 1), lens).cameras[0]
        rt = [0.0, 0.01, 0.0, 0.04 * number, 0.0, 0.0]
        text = foreign_files.mrcal(camera, model, rt)
        newer = text.replace("'extrinsics'", "'rt_cam_ref'") if number else text
        (folder / f"{name}.cameramodel").write_text(newer)
    return folder


def _colmap_binary(geometry: RigGeometry, folder: Path) -> Path:
    foreign_files.colmap_binary(geometry, folder)
    return folder


def _colmap_models(_: RigGeometry, folder: Path) -> Path:
    """Every model that is read."""
    kinds = (
        ("SIMPLE_PINHOLE", 3), ("PINHOLE", 4), ("SIMPLE_RADIAL", 4), ("RADIAL", 5), ("OPENCV", 8),
        ("FULL_OPENCV", 12),
    )  # fmt: skip
    cameras, images = ["# cameras"], ["# images"]
    for number, (name, count) in enumerate(kinds):
        numbers = [600.0, 320.0, 200.0] if count < 8 and name != "PINHOLE" else [600.0] * 4
        numbers += [0.01] * (count - len(numbers))
        words = " ".join(map(str, numbers))
        cameras.append(f"{number} {name} 640 400 {words}")
        images += [f"{number} 1 0 0 0 {0.04 * number} 0 0 {number} view{number}.png", ""]
    (folder / "cameras.txt").write_text("\n".join([*cameras, ""]))
    (folder / "images.txt").write_text("\n".join([*images, ""]))
    return folder


def _ros_of_projections(geometry: RigGeometry, folder: Path) -> Path:
    """As a stereo calibration of ROS writes it, with four coefficients as of old."""
    for number, name in enumerate(("centre", "right")):
        camera = geometry.cameras[number]
        projection = np.hstack([camera.matrix, [[-0.04 * camera.fx_px * number], [0.0], [0.0]]])
        told = {"camera_matrix": camera.matrix, "rectification_matrix": np.eye(3)}
        told |= {"projection_matrix": projection, "distortion_coefficients": np.zeros((1, 4))}
        shaped = {
            key: {"rows": m.shape[0], "cols": m.shape[1], "data": m.ravel().tolist()}
            for key, m in told.items()
        }
        head = {"camera_name": name, "image_width": 640, "image_height": 400}
        content = {**head, "distortion_model": "plumb_bob", **shaped}
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(content, default_flow_style=None))
    return folder


def _ros_alone(geometry: RigGeometry, folder: Path) -> Path:
    _ros_of_projections(geometry, folder)
    (folder / "right.yaml").unlink()
    return folder / "centre.yaml"


_K = ("K_LEFT", "D_LEFT_FE", "K_RIGHT", "D_RIGHT_FE")
_MATLAB = ("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2")
WAYS: Mapping[str, Sequence[Write]] = {
    "caliscope": (
        _text("camera_array.toml", foreign_files.caliscope),
        _text("camera_array.toml", _caliscope_with_one_ignored),
        _text("camera_array.toml", lambda rig: foreign_files.caliscope(_pair(rig), old=True)),
        _text("camera_array.toml", lambda rig: foreign_files.caliscope(_pair(rig, "fisheye"))),
    ),
    "zed": (
        _text("SN1.conf", lambda rig: foreign_files.zed(rig.cameras[0], rig)),
        _text("SN2.conf", _zed_of_two_sizes),
        _text("SN4.conf", _zed_of_one),
        _text("SN5.conf", _zed_of_unknown_size),
        _text("SN3.conf", lambda rig: foreign_files.zed(
            _pair(rig, "fisheye").cameras[0], _pair(rig, "fisheye"))),
    ),
    "kalibr": (_text("camchain.yaml", _kalibr_by_imu),),
    "opencv": (
        _text("pair.json", _pair_in_one(_MATLAB)),
        _text("pair.json", _pair_in_one(_K, "fisheye")),
        _text("one.json", _opencv_alone(("K", "D"), {"image_size": [640, 400]})),
        _text("one.json", _opencv_alone(
            ("camera_matrix", "distortion_coefficients"),
            {"fisheye_model": 1, "image_width": 640, "image_height": 400}, "fisheye")),
        _text("rig.json", _opencv_many),
        _opencv_pair(".yml"),
        _opencv_pair(".xml"),
    ),
    "depthai": (
        _text("eeprom.json", _depthai), _text("board.json", _depthai_board), _depthai_of_old,
    ),
    "mrcal": (_mrcal,),
    "colmap": (_colmap_binary, _colmap_models),
    "ros": (_ros_of_projections, _ros_alone),
}  # fmt: skip
"""By the name of the format."""
