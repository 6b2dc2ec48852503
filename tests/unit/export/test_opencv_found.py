"""OpenCV's FileStorage as its samples and other people name their fields."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.arrays import Float
from rig.errors import FormatError
from rig.export.geometry_format import geometry_format
from rig.geometry.rig_geometry import RigGeometry

MATRIX = np.array([[400.5, 0.0, 319.5], [0.0, 401.5, 239.5], [0.0, 0.0, 1.0]])
LENS = np.array([[-0.1, 0.02, 0.001, -0.002, 0.003]])
TURN = np.array([[0.01], [-0.02], [0.3]])
PLACE = np.array([[-60.0], [1.0], [2.0]])


def storage(path: Path, **values: Float | int | list[int]) -> Path:
    """A file as OpenCV itself writes it; the suffix chooses the form."""
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        if isinstance(value, list):
            file.startWriteStruct(name, cv2.FileNode_SEQ)
            for item in value:
                file.write("", item)
            file.endWriteStruct()
        else:
            file.write(name, value)  # pyright: ignore[reportArgumentType, reportCallIssue]
    file.release()
    return path


def read(path: Path) -> RigGeometry:
    return geometry_format("opencv").read(path)


NAMES = [
    ("M1", "D1", "M2", "D2"),
    ("K1", "D1", "K2", "D2"),
    ("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2"),
    ("K_LEFT", "D_LEFT", "K_RIGHT", "D_RIGHT"),
]


@pytest.mark.parametrize("names", NAMES)
@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
def test_a_pair_in_one_file_sees_points_where_opencv_does(
    tmp_path: Path, names: tuple[str, ...], suffix: str
) -> None:
    second = MATRIX + np.diag([3.0, 4.0, 0.0])
    values = dict(zip(names, (MATRIX, LENS, second, 2.0 * LENS), strict=True))
    rotation, _ = cv2.Rodrigues(TURN)
    file = storage(
        tmp_path / f"any.{suffix}", **values, R=np.asarray(rotation, np.float64), T=PLACE
    )
    found = read(file)
    assert (found.names, found.reference) == (("left", "right"), 0)
    assert (found.cameras[0].width_px, found.cameras[0].height_px) == (639, 479)
    points = np.random.default_rng(1).uniform((-200, -100, 600), (200, 100, 900), (10, 3))
    expected, _ = cv2.projectPoints(points, TURN, PLACE, second, 2.0 * LENS)
    assert found.project(1, points) == pytest.approx(np.asarray(expected).reshape(-1, 2), abs=1e-6)


def test_a_pair_of_fisheyes_may_turn_by_a_vector_and_tell_its_size(tmp_path: Path) -> None:
    lens = np.array([[0.1, -0.02, 0.003, 0.001]])
    file = storage(
        tmp_path / "zed_calibration_1.yml", Size=[1280, 720], K_LEFT=MATRIX, K_RIGHT=MATRIX,
        D_LEFT_FE=lens, D_RIGHT_FE=lens, R=TURN, T=PLACE,
    )  # fmt: skip
    found = read(file)
    assert [camera.lens for camera in found.cameras] == ["fisheye", "fisheye"]
    assert (found.cameras[1].width_px, found.cameras[1].height_px) == (1280, 720)
    assert found.cam_from_reference[1].rotation_rad == pytest.approx(TURN.ravel())


@pytest.mark.parametrize(
    ("names", "size"),
    [
        (("camera_matrix", "distortion_coefficients"), ("image_width", "image_height")),
        (("Camera_Matrix", "Distortion_Coefficients"), ("image_Width", "image_Height")),
        (("K", "D"), ("width", "height")),
    ],
)
def test_one_camera_of_opencvs_sample_is_one_view(
    tmp_path: Path, names: tuple[str, str], size: tuple[str, str]
) -> None:
    matrices = dict(zip(names, (MATRIX, LENS), strict=True))
    file = storage(tmp_path / "left.yml", **matrices, **dict(zip(size, (640, 480), strict=True)))
    found = read(file)
    assert found.names == ("left",)
    (camera,) = found.cameras
    assert (camera.width_px, camera.height_px, camera.fx_px) == (640, 480, 400.5)
    assert camera.coefficients == (-0.1, 0.02, 0.001, -0.002, 0.003)


def test_one_fisheye_of_opencvs_sample_says_so_by_a_flag(tmp_path: Path) -> None:
    lens = np.array([[0.1, -0.02, 0.003, 0.001]])
    values = {"camera_matrix": MATRIX, "distortion_coefficients": lens}
    assert read(storage(tmp_path / "a.yml", **values)).cameras[0].lens == "brown5"
    flagged = read(storage(tmp_path / "b.yml", **values, fisheye_model=1)).cameras[0]
    assert (flagged.lens, flagged.coefficients) == ("fisheye", (0.1, -0.02, 0.003, 0.001))


def test_skew_and_files_without_cameras_are_told_with_what_is_expected(tmp_path: Path) -> None:
    skewed = MATRIX + np.array([[0.0, 0.5, 0.0], [0.0] * 3, [0.0] * 3])
    file = storage(tmp_path / "a.yml", camera_matrix=skewed, distortion_coefficients=LENS)
    with pytest.raises(FormatError, match="expected fx, 0, cx"):
        read(file)
    with pytest.raises(FormatError, match="holds map_x, but no cameras; expected M1, D1"):
        read(storage(tmp_path / "b.yml", map_x=MATRIX))


@pytest.mark.parametrize("count", [1, 3, 6, 13, 15])
def test_lists_that_opencv_does_not_know_are_told_with_those_it_does(
    tmp_path: Path, count: int
) -> None:
    values = {"camera_matrix": MATRIX, "distortion_coefficients": np.zeros((1, count))}
    with pytest.raises(FormatError, match=f"has {count} distortion.*0, 4, 5, 8, 12, 14"):
        read(storage(tmp_path / "a.yml", **values))


EMPTY: dict[str, object] = {"intrinsicMatrix": [], "width": 0, "height": 0, "extrinsics": {}}
ZEROS: dict[str, object] = {**EMPTY, "intrinsicMatrix": [[0.0] * 3] * 3}


def oak(to: int, x_cm: float) -> dict[str, object]:
    """A socket of an old EEPROM: no unit, no lens position, no type."""
    return {
        "width": 1280, "height": 800, "intrinsicMatrix": MATRIX.tolist(),
        "distortionCoeff": [0.0] * 14,
        "extrinsics": {
            "rotationMatrix": [] if to < 0 else np.eye(3).tolist(), "toCameraSocket": to,
            "translation": {"x": x_cm, "y": 0.0, "z": 0.0},
            "measuredTranslation": {"x": 0.0, "y": 0.0, "z": 0.0},
        },
    }  # fmt: skip


@pytest.mark.parametrize("version", [5, 6, 7])
@pytest.mark.parametrize("empty", [EMPTY, ZEROS])
def test_sockets_of_old_eeproms_without_intrinsics_are_left_out(
    tmp_path: Path, version: int, empty: dict[str, object]
) -> None:
    content = {
        "version": version, "boardName": "BW1098OBC", "boardRev": "R1M0E1",
        "swapLeftRightCam": True,
        "cameraData": [[0, oak(-1, 0.0)], [1, oak(2, -7.5)], [2, oak(0, 3.75)], [3, empty]],
    }  # fmt: skip
    file = tmp_path / "oak.json"
    file.write_text(json.dumps(content))
    found = geometry_format("depthai").read(file)
    assert (found.names, found.reference) == (("CAM_A", "CAM_B", "CAM_C"), 0)
    assert found.centres_mm()[:, 0] == pytest.approx([0.0, -37.5, 37.5])


def test_a_board_without_calibration_is_told_as_such(tmp_path: Path) -> None:
    file = tmp_path / "oak.json"
    file.write_text(json.dumps({"boardConf": "nIR-C30M00-00", "version": 7}))
    with pytest.raises(FormatError, match="describes a board of DepthAI without a calibration"):
        geometry_format("depthai").read(file)
    file.write_text(json.dumps({"cameraData": [[0, EMPTY]]}))
    with pytest.raises(FormatError, match="holds no camera with intrinsics"):
        geometry_format("depthai").read(file)
