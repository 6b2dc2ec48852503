"""Files of other tools written by hand, and what they must come to, number by number."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.errors import FormatError
from rig.export import depthai, fields
from rig.export.agreement import aligned, largest_gap_px
from rig.export.geometry_format import geometry_format
from rig.export.lens_change import Narrow, exact_lens, refit
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from tests.unit.export.test_formats import LENSES, SOCKETS, geometry_with

EYE = np.eye(3).tolist()

# --- numbers


@pytest.mark.parametrize("value", [1, 640.0, 999_999])
def test_a_picture_size_is_whole_and_not_absurd(value: float) -> None:
    assert fields.size_px(value, "x") == value


@pytest.mark.parametrize("value", [0, -4, 1.5, 1e6, True, None, "4"])
def test_what_is_no_picture_size_is_refused(value: object) -> None:
    with pytest.raises(FormatError, match="x: expected"):
        fields.size_px(value, "x")


def test_numbers_are_counted() -> None:
    assert fields.numbers([1, 2.5], "x", count=2) == [1.0, 2.5]
    assert fields.numbers([], "x") == []
    with pytest.raises(FormatError, match="expected 3 numbers, found 2"):
        fields.numbers([1, 2], "x", count=3)
    with pytest.raises(FormatError, match="expected 2 rows, found 1"):
        fields.matrix([[1, 2]], (2, 2), "x")
    for odd in ("12", [float("nan")], [True], None):
        with pytest.raises(FormatError):
            fields.numbers(odd, "x")


def test_a_field_that_is_missing_is_named_with_the_first_eight_that_are_there() -> None:
    there = dict.fromkeys("abcdefghij", 1)
    with pytest.raises(FormatError, match="has no z") as caught:
        fields.field(there, "z", "x")
    assert caught.value.advice == "its fields are a, b, c, d, e, f, g, h"


def test_a_rounded_rotation_is_made_exact_and_anything_else_is_refused() -> None:
    turned = Pose.from_vectors(np.array([0.1, -0.2, 0.3]), np.zeros(3)).rotation
    assert np.array_equal(fields.pose(turned, [1.0, 2.0, 3.0], "x").translation_mm, [1.0, 2.0, 3.0])
    rounded = fields.pose(turned + 5e-6 * np.eye(3), [0.0] * 3, "x").rotation
    assert rounded @ rounded.T == pytest.approx(np.eye(3), abs=1e-12)
    assert rounded == pytest.approx(turned, abs=1e-5)
    for odd in (turned + 5e-5 * np.eye(3), np.diag([1.0, 1.0, -1.0])):
        with pytest.raises(FormatError, match="is no rotation"):
            fields.pose(odd, [0.0] * 3, "x")


# --- DepthAI


def eeprom_camera(
    to: int, *, kind: int = 0, coefficients: list[float] | None = None, unit: int | None = 1,
    along: float = 10.0,
) -> dict[str, Any]:  # fmt: skip
    extrinsics: dict[str, Any] = {
        "toCameraSocket": to,
        "translation": {"x": along, "y": 0.0, "z": 0.0},
        "rotationMatrix": EYE,
    }
    if unit is not None:
        extrinsics["lengthUnit"] = unit
    return {
        "cameraType": kind, "width": 640, "height": 400, "extrinsics": extrinsics,
        "intrinsicMatrix": [[500.0, 0.0, 321.0], [0.0, 501.0, 202.0], [0.0, 0.0, 1.0]],
        "distortionCoeff": [0.0] * 14 if coefficients is None else coefficients,
    }  # fmt: skip


def device(folder: Path, *cameras: tuple[int, dict[str, Any]]) -> RigGeometry:
    path = folder / "device.json"
    path.write_text(json.dumps({"cameraData": [list(camera) for camera in cameras]}))
    return depthai.read(path)


@pytest.mark.parametrize(("unit", "along"), [(0, 0.1), (1, 10.0), (2, 100.0), (None, 10.0)])
def test_lengths_of_a_device_are_in_its_unit(
    tmp_path: Path, unit: int | None, along: float
) -> None:
    """The extrinsics of 1 take its points into 0: camera 1 stands 100 mm to the right."""
    there = device(tmp_path, (0, eeprom_camera(-1)), (1, eeprom_camera(0, unit=unit, along=along)))
    assert (there.names, there.reference) == (("CAM_A", "CAM_B"), 0)
    assert there.centres_mm() == pytest.approx(np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0]]))
    camera = there.cameras[1]
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (500.0, 501.0, 321.0, 202.0)
    assert (camera.width_px, camera.height_px, camera.lens) == (640, 400, "brown5")


def test_extrinsics_are_followed_to_their_end(tmp_path: Path) -> None:
    there = device(
        tmp_path, (9, eeprom_camera(2)), (2, eeprom_camera(1, along=5.0)), (1, eeprom_camera(-1))
    )
    assert there.names == ("CAM_B", "CAM_C", "CAM_J")
    assert there.reference == 0
    assert there.centres_mm()[:, 0] == pytest.approx([0.0, 50.0, 150.0])
    odd = device(tmp_path, (10, eeprom_camera(-1)))
    assert odd.names == ("socket 10",)


@pytest.mark.parametrize(
    ("cameras", "says"),
    [
        ([(0, -1), (1, -1)], "of 2 cameras end at 2 of them"),
        ([(0, 1), (1, 0)], "of 2 cameras end at 0 of them"),
        ([(0, -1), (1, 2), (2, 1)], "go round in a circle"),
    ],
)
def test_extrinsics_that_reach_no_single_camera_are_refused(
    tmp_path: Path, cameras: list[tuple[int, int]], says: str
) -> None:
    with pytest.raises(FormatError, match=says):
        device(tmp_path, *((number, eeprom_camera(to)) for number, to in cameras))


@pytest.mark.parametrize(
    ("kind", "coefficients", "lens", "used"),
    [
        (0, [0.1, 0.2, 0.3, 0.4, 0.5] + [0.0] * 3, "brown5", 5),
        (0, [0.1] + [0.0] * 6 + [0.5] + [0.0] * 6, "brown8", 8),
        (1, [0.1, 0.2, 0.3, 0.4], "fisheye", 4),
        (1, [0.1, 0.2, 0.3, 0.4] + [0.0] * 10, "fisheye", 4),
    ],
)
def test_lenses_of_a_device(
    tmp_path: Path, kind: int, coefficients: list[float], lens: str, used: int
) -> None:
    there = device(tmp_path, (0, eeprom_camera(-1, kind=kind, coefficients=coefficients)))
    assert there.cameras[0].lens == lens
    assert there.cameras[0].coefficients == tuple(coefficients[:used])


@pytest.mark.parametrize(
    ("kind", "coefficients", "says"),
    [
        (0, [0.1] * 5, "camera type 0 with 5 coefficients"),
        (0, [0.0] * 7, "camera type 0 with 7 coefficients"),
        (1, [0.1] * 3, "camera type 1 with 3 coefficients"),
        (2, [0.0] * 14, "camera type 2"),
        (0, [0.0] * 8 + [0.1] + [0.0] * 5, "thin-prism or tilted"),
        (0, [0.0] * 13 + [0.1], "thin-prism or tilted"),
        (1, [0.1] * 5, "thin-prism or tilted"),
    ],
)
def test_lenses_that_are_not_known_are_refused(
    tmp_path: Path, kind: int, coefficients: list[float], says: str
) -> None:
    with pytest.raises(FormatError, match=says):
        device(tmp_path, (0, eeprom_camera(-1, kind=kind, coefficients=coefficients)))


def test_entries_of_a_device_are_pairs_and_units_are_known(tmp_path: Path) -> None:
    path = tmp_path / "device.json"
    for entry in ([0], [0, eeprom_camera(-1), 1], 3):
        path.write_text(json.dumps({"cameraData": [entry]}))
        with pytest.raises(FormatError, match="pairs of socket and calibration"):
            depthai.read(path)
    path.write_text(json.dumps({"cameraData": {}}))
    with pytest.raises(FormatError, match="has no list cameraData"):
        depthai.read(path)
    with pytest.raises(FormatError, match="length unit 3 is not known"):
        device(tmp_path, (0, eeprom_camera(-1)), (1, eeprom_camera(0, unit=3)))


def test_what_is_written_for_a_device(tmp_path: Path) -> None:
    geometry = geometry_with("fisheye")
    depthai.write(geometry, tmp_path / "c.json", sockets=SOCKETS)
    content = json.loads((tmp_path / "c.json").read_text())
    assert content["version"] == 7
    assert content["stereoEnableDistortionCorrection"] is False
    assert content["stereoUseSpecTranslation"] is False
    assert content["verticalCameraSocket"] == -1
    assert (content["batchTime"], content["boardOptions"]) == (0, 0)
    stereo = content["stereoRectificationData"]
    assert (stereo["leftCameraSocket"], stereo["rightCameraSocket"]) == (-1, -1)
    (left, entry), (middle, reference), (top, _) = content["cameraData"]
    assert (left, middle, top) == (1, 0, 3)
    assert entry["cameraType"] == 1
    assert entry["distortionCoeff"] == [*LENSES["fisheye"], *[0.0] * 10]
    assert (entry["width"], entry["height"], entry["lensPosition"]) == (1280, 800, 0)
    wide_deg = 2.0 * np.degrees(np.arctan(640.0 / 881.3))
    assert entry["specHfovDeg"] == pytest.approx(wide_deg)
    assert entry["extrinsics"]["toCameraSocket"] == 0
    assert entry["extrinsics"]["lengthUnit"] == 1
    centre_mm = geometry.centres_mm()[0]
    assert [10.0 * entry["extrinsics"]["translation"][axis] for axis in "xyz"] == pytest.approx(
        list(centre_mm)
    )
    assert np.array(entry["extrinsics"]["rotationMatrix"]) == pytest.approx(
        geometry.cam_from_reference[0].rotation.T
    )
    assert reference["extrinsics"]["toCameraSocket"] == -1
    assert reference["extrinsics"]["rotationMatrix"] == []
    depthai.write(geometry_with("brown5"), tmp_path / "c.json", sockets=SOCKETS)
    content = json.loads((tmp_path / "c.json").read_text())
    assert content["cameraData"][0][1]["cameraType"] == 0
    with pytest.raises(FormatError, match="same socket"):
        depthai.write(geometry, tmp_path / "c.json", sockets=dict.fromkeys(SOCKETS, "CAM_A"))


# --- COLMAP


def colmap(folder: Path, camera: str, *images: str) -> RigGeometry:
    (folder / "cameras.txt").write_text(f"# cameras\n\n1 {camera}\n")
    (folder / "images.txt").write_text("# images\n" + "".join(f"{i}\n\n" for i in images))
    return geometry_format("colmap").read(folder)


AT_HOME = "1 1 0 0 0 0 0 0 1 left.png"


@pytest.mark.parametrize(
    ("camera", "focal_px", "centre_px", "lens", "coefficients"),
    [
        ("SIMPLE_PINHOLE 640 400 500 320 200", (500, 500), (319.5, 199.5), "none", ()),
        ("PINHOLE 640 400 500 501 320 200", (500, 501), (319.5, 199.5), "none", ()),
        ("OPENCV 640 400 500 501 320 200 1 2 3 4", (500, 501), (319.5, 199.5), "brown5",
         (1, 2, 3, 4, 0)),
        ("FULL_OPENCV 640 400 500 501 320 200 1 2 3 4 5 0 0 0", (500, 501), (319.5, 199.5),
         "brown5", (1, 2, 3, 4, 5)),
        ("FULL_OPENCV 640 400 500 501 320 200 1 2 3 4 5 6 0 0", (500, 501), (319.5, 199.5),
         "brown8", (1, 2, 3, 4, 5, 6, 0, 0)),
        ("FULL_OPENCV 640 400 500 501 320 200 1 2 3 4 5 0 0 8", (500, 501), (319.5, 199.5),
         "brown8", (1, 2, 3, 4, 5, 0, 0, 8)),
        ("OPENCV_FISHEYE 640 400 500 501 320 200 1 2 3 4", (500, 501), (319.5, 199.5), "fisheye",
         (1, 2, 3, 4)),
    ],
)  # fmt: skip
def test_models_of_colmap(
    tmp_path: Path, camera: str, focal_px: tuple[float, float], centre_px: tuple[float, float],
    lens: str, coefficients: tuple[float, ...],
) -> None:  # fmt: skip
    (found,) = colmap(tmp_path, camera, AT_HOME).cameras
    assert (found.width_px, found.height_px) == (640, 400)
    assert (found.fx_px, found.fy_px) == focal_px
    assert (found.cx_px, found.cy_px) == centre_px
    assert (found.lens, found.coefficients) == (lens, coefficients)


def test_images_of_colmap_are_seen_from_the_first(tmp_path: Path) -> None:
    """Half turns about the axis; lengths in m."""
    there = colmap(
        tmp_path, "PINHOLE 640 400 500 501 320 200",
        "1 1 0 0 0 0.1 0 0 1 my left.png", "2 0 0 0 1 0 0.2 0 1 sub/right.png",
    )  # fmt: skip
    assert (there.names, there.reference) == (("my left", "right"), 0)
    assert there.cam_from_reference[1].rotation == pytest.approx(np.diag([-1.0, -1.0, 1.0]))
    # Into the world by -100 mm, turned, and 200 mm down.
    assert there.cam_from_reference[1].translation_mm == pytest.approx([100.0, 200.0, 0.0])


@pytest.mark.parametrize(
    ("camera", "images", "says"),
    [
        ("PINHOLE 640 400 500 501 320 200", ["1 1 0 0 0 0 0 0 1"], "expected 10 fields"),
        ("PINHOLE 640 400 500 501 320 200", ["1 1 0 0 0 0 0 0 2 a.png"], "expected 10 fields"),
        ("PINHOLE 640 400 500 501 320 200", ["1 0.98 0 0 0 0 0 0 1 a.png"], "length 0.98"),
        ("PINHOLE 640 400 500 501 320 200", ["1 1.02 0 0 0 0 0 0 1 a.png"], "length 1.02"),
        ("PINHOLE 640 400 500 501 320 200", [], "0 images of 0 views"),
        ("PINHOLE 640 400 500 501 320 200", [AT_HOME, AT_HOME], "2 images of 1 views"),
        ("PINHOLE 640 400 500 501 320", [AT_HOME], "expected 4 numbers, found 3"),
        ("PINHOLE 640", [AT_HOME], "camera model PINHOLE is not known"),
        ("THIN 640 400 1", [AT_HOME], "camera model THIN is not known"),
    ],
)
def test_what_colmap_does_not_write_is_refused(
    tmp_path: Path, camera: str, images: list[str], says: str
) -> None:
    with pytest.raises(FormatError, match=says):
        colmap(tmp_path, camera, *images)


# --- Kalibr, mrcal, OpenCV


def test_a_chain_of_kalibr_is_followed_in_metres(tmp_path: Path) -> None:
    entry: dict[str, Any] = {
        "camera_model": "pinhole", "distortion_model": "radtan", "resolution": [640, 400],
        "distortion_coeffs": [0.1, 0.2, 0.3, 0.4], "intrinsics": [500.0, 501.0, 320.0, 200.0],
    }  # fmt: skip
    step = np.eye(4)
    step[:3, 3] = (0.04, 0.0, 0.001)
    chain = {
        "cam0": entry | {"rostopic": "/left/image_raw"},
        "cam1": entry | {"T_cn_cnm1": step.tolist()},
        "cam2": entry | {"T_cn_cnm1": step.tolist()},
    }
    path = tmp_path / "camchain.yaml"
    path.write_text(yaml.safe_dump(chain))
    there = geometry_format("kalibr").read(path)
    assert (there.names, there.reference) == (("left", "cam1", "cam2"), 0)
    moved_mm = [pose.translation_mm.tolist() for pose in there.cam_from_reference]
    assert moved_mm[0] == [0.0, 0.0, 0.0]
    assert moved_mm[1] == pytest.approx([40.0, 0.0, 1.0])
    assert moved_mm[2] == pytest.approx([80.0, 0.0, 2.0])
    assert there.cameras[0].coefficients == (0.1, 0.2, 0.3, 0.4, 0.0)
    assert there.cameras[0].lens == "brown5"
    path.write_text("{}")
    with pytest.raises(FormatError, match="holds no camera"):
        geometry_format("kalibr").read(path)


@pytest.mark.parametrize("key", ["extrinsics", "rt_cam_ref"])
def test_models_of_mrcal_have_four_terms_and_metres(tmp_path: Path, key: str) -> None:
    for name, along in (("a", 0.04), ("b", 0.0)):
        (tmp_path / f"{name}.cameramodel").write_text(
            "{'lensmodel': 'LENSMODEL_OPENCV4', 'intrinsics': [500, 501, 320, 200, .1, .2, .3, .4],"
            f"'{key}': [0, 0, 0, {along}, 0, 0], 'imagersize': [640, 400]}}"
        )
    there = geometry_format("mrcal").read(tmp_path)
    assert (there.names, there.reference) == (("a", "b"), 1)
    assert there.cam_from_reference[0].translation_mm == pytest.approx([40.0, 0.0, 0.0])
    camera = there.cameras[0]
    assert (camera.lens, camera.coefficients) == ("brown5", (0.1, 0.2, 0.3, 0.4, 0.0))
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (500, 501, 320, 200)
    (tmp_path / "b.cameramodel").unlink()
    alone = geometry_format("mrcal").read(tmp_path)  # nobody at the origin: the first by name
    assert alone.reference == 0
    assert alone.cam_from_reference[0].translation_mm.tolist() == [0.0, 0.0, 0.0]


def sample_of_opencv(folder: Path, coefficients: list[float]) -> RigGeometry:
    def matrix(rows: int, values: list[float]) -> str:
        return (
            f"!!opencv-matrix\n  rows: {rows}\n  cols: {len(values) // rows}\n  dt: d\n"
            f"  data: {values}\n"
        )

    inside = [500.0, 0.0, 320.2, 0.0, 501.0, 199.9, 0.0, 0.0, 1.0]
    lines = "".join(
        f"M{n}: {matrix(3, inside)}D{n}: {matrix(1, coefficients)}" for n in (1, 2)
    )  # fmt: skip
    (folder / "intrinsics.yml").write_text(f"%YAML:1.0\n---\n{lines}")
    turn = [float(n) for n in np.eye(3).ravel()]
    (folder / "extrinsics.yml").write_text(
        f"%YAML:1.0\n---\nR: {matrix(3, turn)}T: {matrix(3, [-60.0, 1.0, 2.0])}"
    )
    return geometry_format("opencv").read(folder)


@pytest.mark.parametrize(
    ("coefficients", "lens", "taken"),
    [
        ([0.1, 0.2, 0.3, 0.4], "brown5", (0.1, 0.2, 0.3, 0.4, 0.0)),
        ([0.1, 0.2, 0.3, 0.4, 0.5], "brown5", (0.1, 0.2, 0.3, 0.4, 0.5)),
        ([0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.8], "brown8", (0.1, 0, 0, 0, 0, 0, 0, 0.8)),
        ([0.1, 0.0, 0.0, 0.0, 0.0, 0.6, 0.0, 0.0], "brown8", (0.1, 0, 0, 0, 0, 0.6, 0, 0)),
        ([0.1] + [0.0] * 13, "brown5", (0.1, 0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_a_pair_of_opencvs_sample(
    tmp_path: Path, coefficients: list[float], lens: str, taken: tuple[float, ...]
) -> None:
    there = sample_of_opencv(tmp_path, coefficients)
    assert (there.names, there.reference) == (("left", "right"), 0)
    assert there.cam_from_reference[1].translation_mm == pytest.approx([-60.0, 1.0, 2.0])
    camera = there.cameras[1]
    assert (camera.width_px, camera.height_px) == (640, 400)  # twice the principal point
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (500.0, 501.0, 320.2, 199.9)
    assert (camera.lens, camera.coefficients) == (lens, taken)


@pytest.mark.parametrize("place", [8, 9, 13])
def test_a_thin_prism_of_opencv_is_refused(tmp_path: Path, place: int) -> None:
    coefficients = [0.0] * 14
    coefficients[place] = 0.1
    with pytest.raises(FormatError, match="thin-prism or tilted"):
        sample_of_opencv(tmp_path, coefficients)


def test_a_pair_is_also_written_as_the_sample_has_it_but_for_fisheyes(tmp_path: Path) -> None:
    whole = geometry_with("brown5")
    fish = geometry_with("fisheye").cameras

    def written(geometry: RigGeometry, name: str) -> bool:
        (tmp_path / name).mkdir()
        geometry_format("opencv").write(geometry, tmp_path / name)
        return (tmp_path / name / "extrinsics.yml").exists()

    pair = RigGeometry(whole.names[:2], 1, whole.cameras[:2], whole.cam_from_reference[:2])
    assert written(pair, "pair")
    assert not written(whole, "three")
    assert not written(replace(pair, cameras=(fish[0], pair.cameras[1])), "half")


# --- lenses


def camera(lens: LensModel, coefficients: tuple[float, ...]) -> CameraModel:
    return CameraModel(640, 400, 500.0, 501.0, 321.0, 202.0, lens, coefficients)


@pytest.mark.parametrize(
    ("lens", "coefficients", "held", "exact"),
    [
        ("none", (), "brown4", (0, 0, 0, 0)),
        ("none", (), "brown8", (0,) * 8),
        ("none", (), "none", ()),
        ("brown5", (1, 2, 3, 4, 0), "brown4", (1, 2, 3, 4)),
        ("brown5", (1, 2, 3, 4, 5), "brown8", (1, 2, 3, 4, 5, 0, 0, 0)),
        ("brown8", (1, 2, 3, 4, 5, 0, 0, 0), "brown5", (1, 2, 3, 4, 5)),
        ("fisheye", (1, 2, 3, 4), "fisheye", (1, 2, 3, 4)),
    ],
)
def test_a_lens_is_held_where_nothing_is_lost(
    lens: LensModel, coefficients: tuple[float, ...], held: Narrow, exact: tuple[float, ...]
) -> None:
    assert exact_lens(camera(lens, coefficients), held, view="a", tool="it") == exact


@pytest.mark.parametrize(
    ("lens", "coefficients", "held"),
    [
        ("brown5", (1, 2, 3, 4, 5), "brown4"),
        ("brown8", (1, 2, 3, 4, 5, 0, 0, 8), "brown5"),
        ("brown8", (1, 2, 3, 4, 5, 6, 0, 0), "brown5"),
        ("fisheye", (1, 2, 3, 4), "brown8"),
        ("fisheye", (0, 0, 0, 0), "brown5"),
        ("brown5", (1, 2, 3, 4, 5), "fisheye"),
        ("brown5", (0, 0, 0, 0, 0), "none"),
    ],
)
def test_a_lens_that_would_lose_something_is_refused(
    lens: LensModel, coefficients: tuple[float, ...], held: Narrow
) -> None:
    with pytest.raises(FormatError, match=f"view a: it cannot hold its lens {lens}"):
        exact_lens(camera(lens, coefficients), held, view="a", tool="it")


@pytest.mark.parametrize(
    ("lens", "coefficients", "held"),
    [
        ("brown5", (-0.1, 0.02, 1e-3, -2e-3, 0.0), "brown4"),
        ("brown5", (-0.1, 0.02, 1e-3, -2e-3, 0.01), "brown5"),
        ("brown8", (-0.1, 0.02, 1e-3, -2e-3, 0.01, 0.0, 0.0, 0.0), "brown5"),
        ("fisheye", (-0.02, 0.006, -0.003, 0.0008), "fisheye"),
    ],
)
def test_a_lens_that_fits_is_found_again(
    lens: LensModel, coefficients: tuple[float, ...], held: Narrow
) -> None:
    original = camera(lens, coefficients)
    found = refit(original, held)
    assert found.largest_px < 1e-6
    assert found.rms_px <= found.largest_px
    fitted = found.camera
    assert (fitted.width_px, fitted.height_px) == (640, 400)
    assert (fitted.fx_px, fitted.fy_px, fitted.cx_px, fitted.cy_px) == pytest.approx(
        (500.0, 501.0, 321.0, 202.0)
    )
    count = len(fitted.coefficients)
    assert fitted.coefficients == pytest.approx(coefficients[:count], abs=1e-9)


def test_a_refit_tells_its_error_over_all_of_the_picture() -> None:
    original = camera("brown5", (-0.2, 0.0, 0.0, 0.0, 0.05))
    found = refit(original, "brown4")
    assert found.camera.coefficients[4] == 0.0
    u, v = np.meshgrid(np.linspace(0.0, 639.0, 33), np.linspace(0.0, 399.0, 25))
    pixels = np.stack([u.ravel(), v.ravel()], axis=1)
    points = np.column_stack([original.unproject(pixels), np.ones(len(pixels))])
    apart_px = np.linalg.norm(found.camera.project(points) - pixels, axis=1)
    assert found.largest_px == pytest.approx(apart_px.max())
    assert found.rms_px == pytest.approx(np.sqrt(np.mean(apart_px**2)))
    assert 0.0 < found.rms_px < found.largest_px < 1.0


# --- agreement


def plain(
    change: Callable[[CameraModel], CameraModel] = lambda c: c, x_mm: float = 0.0
) -> RigGeometry:
    one = camera("none", ())
    poses = (Pose.identity(), Pose(np.eye(3), np.array([-60.0 + x_mm, 0.0, 0.0])))
    return RigGeometry(("a", "b"), 0, (one, change(one)), poses)


def test_the_gap_is_the_largest_of_all_depths_and_views() -> None:
    assert largest_gap_px(plain(), plain()) == pytest.approx(0.0, abs=1e-9)
    shifted = plain(lambda c: replace(c, cx_px=c.cx_px + 0.25))
    assert largest_gap_px(plain(), shifted) == pytest.approx(0.25)
    # A camera 1 mm beside: seen at the nearest of the depths, 300 mm, f / 300 px.
    assert largest_gap_px(plain(), plain(x_mm=1.0)) == pytest.approx(500.0 / 300.0)
    # A focal length 1 % longer: at the corner of the picture, (321, 202) px from the middle.
    longer = plain(lambda c: replace(c, fx_px=505.0, fy_px=506.01))
    assert largest_gap_px(plain(), longer) == pytest.approx(0.01 * np.hypot(321.0, 202.0))


def test_what_belongs_to_the_old_reference_stays_behind() -> None:
    one = plain()
    whole = replace(one, covariance=np.eye(one.parameter_count))
    assert aligned(whole, ("a", "b"), "a").covariance is not None
    assert aligned(whole, ("a", "b"), "b").covariance is None
    assert aligned(whole, ("b", "a"), "a").covariance is None
    turned = aligned(whole, ("b", "a"), "b")
    assert (turned.names, turned.reference) == (("b", "a"), 0)
    assert turned.centres_mm() == pytest.approx(np.array([[0.0, 0.0, 0.0], [-60.0, 0.0, 0.0]]))
    with pytest.raises(FormatError, match="with c as reference"):
        aligned(whole, ("a", "b"), "c")
    with pytest.raises(FormatError, match="asked for the views a, c"):
        aligned(whole, ("a", "c"), "a")
