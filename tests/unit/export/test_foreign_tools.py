"""Calibrations of other tools against the projection that their own definition gives.

Pixels come from OpenCV's projection of the numbers that stand in the file; the reader is judged by
where it puts the same points.
"""

import math
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from rig.arrays import Float
from rig.errors import FormatError
from rig.export import anipose, caliscope, colmap, mrcal, oak_gen1, zed
from rig.export.quaternion import matrix_of, quaternion_of
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from tests.support import foreign_files
from tests.unit.export.test_formats import LENSES, geometry_with

POINTS_MM = np.random.default_rng(5).uniform((-300, -200, 700), (300, 200, 1500), (20, 3))
SETTINGS = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=5, deadline=None
)


def by_opencv(camera: CameraModel, cam_from_world: Pose, points_mm: Float) -> Float:
    turn, _ = cv2.Rodrigues(cam_from_world.rotation)
    given_points = points_mm.reshape(-1, 1, 3)
    if camera.lens == "fisheye":
        pixels, _ = cv2.fisheye.projectPoints(
            given_points, turn, cam_from_world.translation_mm, camera.matrix,
            np.array(camera.coefficients),
        )  # fmt: skip
    else:
        pixels, _ = cv2.projectPoints(
            given_points, turn, cam_from_world.translation_mm, camera.matrix,
            np.array(camera.coefficients or (0.0,) * 5),
        )  # fmt: skip
    return np.asarray(pixels, np.float64).reshape(-1, 2)


def require_same(found: RigGeometry, told: RigGeometry, order: Sequence[int]) -> None:
    """Every view of `found` sees the points where the numbers of `told` put them."""
    reference = told.cam_from_reference[order[found.reference]]
    for view, index in enumerate(order):
        expected = by_opencv(told.cameras[index], told.cam_from_reference[index], POINTS_MM)
        seen = found.project(view, reference.apply(POINTS_MM))
        assert seen == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("lens", LENSES)
def test_caliscope_cameras_see_points_where_its_numbers_put_them(
    tmp_path: Path, lens: LensModel
) -> None:
    told = geometry_with(lens)
    file = tmp_path / "camera_array.toml"
    for old in (False, True):
        file.write_text(foreign_files.caliscope(told, old=old))
        for path in (file, tmp_path):
            found = caliscope.read(path)
            assert (found.names, found.reference) == (("cam_0", "cam_1", "cam_2"), 1)
            assert (found.cameras[0].width_px, found.cameras[0].height_px) == (1280, 800)
            require_same(found, told, (0, 1, 2))


def test_caliscope_cameras_that_are_ignored_are_left_out(tmp_path: Path) -> None:
    told = geometry_with("brown5")
    text = foreign_files.caliscope(told).replace("ignore = false", "ignore = true", 1)
    (tmp_path / "camera_array.toml").write_text(text)
    found = caliscope.read(tmp_path)
    assert found.names == ("cam_1", "cam_2")
    require_same(found, told, (1, 2))


@pytest.mark.parametrize(("key", "step"), [("rotation", "extrinsic"), ("matrix", "intrinsic")])
def test_a_camera_that_waits_for_a_step_of_caliscope_is_told_with_the_step(
    tmp_path: Path, key: str, step: str
) -> None:
    lines = foreign_files.caliscope(geometry_with("brown5")).splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith(f"{key} ="))
    (tmp_path / "c.toml").write_text("\n".join([*lines[:at], *lines[at + 1 :]]))
    with pytest.raises(FormatError, match=f"cam_0: has no {key}.*the {step} calibration"):
        caliscope.read(tmp_path / "c.toml")


@pytest.mark.parametrize("lens", LENSES)
def test_anipose_cameras_see_points_where_its_numbers_put_them(
    tmp_path: Path, lens: LensModel
) -> None:
    told = geometry_with(lens)
    anipose.write(told, tmp_path / "calibration.toml")
    found = anipose.read(tmp_path)
    assert (found.names, found.reference) == (told.names, 1)
    require_same(found, told, (0, 1, 2))


def test_anipose_files_are_as_its_own_program_writes_them(tmp_path: Path) -> None:
    """Keys and kinds of values as `CameraGroup.dump` has them; lengths in mm."""
    anipose.write(geometry_with("fisheye"), tmp_path / "calibration.toml")
    lines = (tmp_path / "calibration.toml").read_text().splitlines()
    assert lines[:3] == ["[cam_0]", 'name = "left"', "size = [1280, 800]"]
    assert lines[3] == "matrix = [[881.3, 0.0, 637.2], [0.0, 879.9, 402.8], [0.0, 0.0, 1.0]]"
    assert lines[4] == "distortions = [-0.02, 0.006, -0.003, 0.0008]"
    assert lines[6] == "translation = [75.1, -0.4, 0.9]"
    assert lines[7] == "fisheye = true"
    assert lines[-1] == "[metadata]"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("size = [1280, 800]", "size = [1280]"), "size: expected 2 numbers, found 1"),
        (("[881.3, 0.0", "[881.3, 0.5"), "matrix: is"),
        (("fisheye = true", "fisheye = 1"), "fisheye must be true or false"),
        (("name = \"centre\"", "name = \"left\""), "two cameras have one name"),
        (("-0.02, 0.006, -0.003, 0.0008", "0.1, 0.2"), "2 coefficients of a fisheye"),
        (("translation = [75.1", "translation = [1e10"), "no camera of a rig"),
        (("rotation = [", "rotation = [1e9, "), "expected 3 numbers, found 4"),
    ],
)  # fmt: skip
def test_odd_numbers_of_anipose_are_told_with_their_place(
    tmp_path: Path, change: tuple[str, str], says: str
) -> None:
    file = tmp_path / "calibration.toml"
    anipose.write(geometry_with("fisheye"), file)
    file.write_text(file.read_text().replace(*change))
    with pytest.raises(FormatError, match=says):
        anipose.read(file)


@pytest.mark.parametrize("lens", LENSES)
def test_colmap_binary_models_see_points_where_their_numbers_put_them(
    tmp_path: Path, lens: LensModel
) -> None:
    told = geometry_with(lens)
    foreign_files.colmap_binary(told, tmp_path)
    for path in (tmp_path, tmp_path / "cameras.bin"):
        found = colmap.read(path)
        assert (found.names, found.reference) == (told.names, 0)
        require_same(found, told, (0, 1, 2))


def test_images_of_one_name_are_called_after_their_folders(tmp_path: Path) -> None:
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 400 500 501 320 200\n")
    lines = ("1 1 0 0 0 0 0 0 1 left/1.png", "2 1 0 0 0 -0.1 0 0 1 b/right/1.png")
    (tmp_path / "images.txt").write_text("\n\n".join([*lines, ""]))
    assert colmap.read(tmp_path).names == ("left", "right")


@pytest.mark.parametrize(
    ("model", "numbers", "coefficients"),
    [
        ("SIMPLE_FISHEYE", "500 320.5 200.5", (0.0, 0.0, 0.0, 0.0)),
        ("FISHEYE", "500 500 320.5 200.5", (0.0, 0.0, 0.0, 0.0)),
        ("SIMPLE_RADIAL_FISHEYE", "500 320.5 200.5 0.1", (0.1, 0.0, 0.0, 0.0)),
        ("RADIAL_FISHEYE", "500 320.5 200.5 0.1 -0.02", (0.1, -0.02, 0.0, 0.0)),
    ],
)
def test_fisheyes_of_colmap_bend_the_angle(
    tmp_path: Path, model: str, numbers: str, coefficients: tuple[float, ...]
) -> None:
    (tmp_path / "cameras.txt").write_text(f"1 {model} 640 400 {numbers}\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 left.png\n\n")
    (camera,) = colmap.read(tmp_path).cameras
    assert (camera.lens, camera.coefficients) == ("fisheye", coefficients)
    angle = 0.4
    bent = angle * (1 + coefficients[0] * angle**2 + coefficients[1] * angle**4)
    seen = camera.project(np.array([[np.tan(angle), 0.0, 1.0]]))
    assert seen == pytest.approx(np.array([[320.0 + 500.0 * bent, 200.0]]))


def test_fisheyes_of_colmap_are_those_of_its_own_library(tmp_path: Path) -> None:
    pycolmap = pytest.importorskip("pycolmap", reason="pycolmap is not installed")
    ray = np.array([0.3, -0.2, 1.0])
    for model, numbers in {
        "SIMPLE_FISHEYE": [500, 320, 200],
        "SIMPLE_RADIAL_FISHEYE": [500, 320, 200, 0.1],
        "RADIAL_FISHEYE": [500, 320, 200, 0.1, -0.02],
    }.items():
        theirs = pycolmap.Camera(model=model, width=640, height=400, params=numbers)
        (tmp_path / "cameras.txt").write_text(f"1 {model} 640 400 {' '.join(map(str, numbers))}\n")
        (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 left.png\n\n")
        (ours,) = colmap.read(tmp_path).cameras
        expected = np.asarray(theirs.img_from_cam(ray)).reshape(2) - 0.5
        assert ours.project(ray[None])[0] == pytest.approx(expected, abs=1e-9)


def cut(content: bytes, count: int) -> bytes:
    return content[:count]


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("cameras.bin", lambda b: struct.pack("<Q", 2**60) + b[8:], "holds 1152921504606846976"),
        ("images.bin", lambda b: struct.pack("<Q", 1001) + b[8:], "1001 images, rigs have 1000"),
        ("images.bin", lambda b: struct.pack("<Q", 4) + b[8:], "asked for"),
        ("images.bin", lambda b: cut(b, 80), "a name does not end|asked for"),
        ("images.bin", lambda b: b.replace(b"left", b"\xff\xfe\xfd\xfc"), "a name is no text"),
        ("cameras.bin", lambda b: b[:12] + struct.pack("<i", 7) + b[16:], "camera model FOV"),
        ("cameras.bin", lambda b: b[:12] + struct.pack("<i", 99) + b[16:], "model number 99"),
        ("cameras.bin", lambda b: b[:16] + struct.pack("<Q", 2**63) + b[24:], "a picture size"),
    ],
)
def test_damaged_binary_models_are_told_with_the_place(
    tmp_path: Path, name: str, change: Callable[[bytes], bytes], says: str
) -> None:
    foreign_files.colmap_binary(geometry_with("none"), tmp_path)
    file = tmp_path / name
    file.write_bytes(change(file.read_bytes()))
    with pytest.raises(FormatError, match=says):
        colmap.read(tmp_path)


@pytest.mark.parametrize("at", [4, 36], ids=["turn", "place"])
@pytest.mark.parametrize("number", [math.nan, math.inf, 1e200])
def test_absurd_numbers_of_a_binary_image_are_told(tmp_path: Path, at: int, number: float) -> None:
    foreign_files.colmap_binary(geometry_with("none"), tmp_path)
    file = tmp_path / "images.bin"
    content = bytearray(file.read_bytes())
    content[8 + at + 8 : 8 + at + 16] = struct.pack("<d", number)  # the second of four or three
    file.write_bytes(content)
    with pytest.raises(
        FormatError, match=r"images.bin.*(quaternion has length|no camera of a rig does|finite)"
    ):
        colmap.read(tmp_path)


@SETTINGS
@example(at=0.375, junk=b"_", name="images")  # an exponent
@given(at=st.floats(0, 1), junk=st.binary(max_size=12), name=st.sampled_from(["cameras", "images"]))
def test_any_damage_to_binary_models_is_refused_or_reads(
    tmp_path: Path, at: float, junk: bytes, name: str
) -> None:
    foreign_files.colmap_binary(geometry_with("brown5"), tmp_path)
    file = tmp_path / f"{name}.bin"
    content = file.read_bytes()
    start = int(at * len(content))
    file.write_bytes(content[:start] + junk + content[start + len(junk) :])
    try:
        found = colmap.read(tmp_path)
    except FormatError as error:
        assert str(tmp_path) in str(error)
    else:
        assert len(found.names) == 3


ZED_SIDES = ("LEFT_CAM_HD", "RIGHT_CAM_HD")


def pair_with(lens: LensModel) -> RigGeometry:
    """A pair whose reference is the left camera, as a device is."""
    whole = geometry_with(lens)
    place = Pose.from_vectors(np.array([0.004, -0.003, 0.001]), np.array([-119.9, 0.1, -0.2]))
    return RigGeometry(("left", "right"), 0, whole.cameras[:2], (Pose.identity(), place))


@pytest.mark.parametrize("lens", LENSES)
def test_a_zed_sees_points_where_its_configuration_puts_them(
    tmp_path: Path, lens: LensModel
) -> None:
    told = pair_with(lens)
    (tmp_path / "SN1.conf").write_text(foreign_files.zed(told.cameras[0], told))
    found = zed.read(tmp_path / "SN1.conf")
    assert (found.names, found.reference) == (ZED_SIDES, 0)
    assert (found.cameras[1].width_px, found.cameras[1].height_px) == (1280, 720)
    assert found.centres_mm()[1][0] == pytest.approx(119.9, abs=1.0)
    require_same(found, told, (0, 1))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("[STEREO]", "[OTHER]"), "has no sections"),
        (("_CAM_HD", "_CAM_9K"), "cameras 9K, whose picture size"),
        (("[LEFT_CAM_HD]", "[AUFT_CAM_HD]"), "has no left camera"),
        (("Baseline=", "Baseline=x"), "baseline is 'x119.9', expected a number"),
        (("RX_HD", "RX_2K"), "has no rx_hd"),
        (("k3=", "s1=0.1\nk3="), "thin-prism"),
        (("[MISC]", "MISC["), "is no ZED configuration"),
    ],
)
def test_odd_configurations_of_a_zed_are_told_with_what_is_odd(
    tmp_path: Path, change: tuple[str, str], says: str
) -> None:
    told = pair_with("brown5")
    file = tmp_path / "SN1.conf"
    file.write_text(foreign_files.zed(told.cameras[0], told).replace(*change))
    with pytest.raises(FormatError, match=says):
        zed.read(file)


@pytest.mark.parametrize(
    ("model", "lens", "coefficients"),
    [
        ("LENSMODEL_PINHOLE", "none", ()),
        ("LENSMODEL_OPENCV4", "brown5", (0.1, 0.2, 0.03, 0.04)),
        ("LENSMODEL_OPENCV8", "brown8", (0.1, 0.2, 0.03, 0.04, 0.5, 0.6, 0.7, 0.8)),
        ("LENSMODEL_OPENCV12", "brown8", (0.1, 0.2, 0.03, 0.04, 0.5, 0.6, 0.7, 0.8, 0, 0, 0, 0)),
    ],
)
def test_one_file_of_mrcal_with_all_that_it_adds_is_one_view(
    tmp_path: Path, model: str, lens: LensModel, coefficients: tuple[float, ...]
) -> None:
    file = tmp_path / "cam-0.cameramodel"
    numbers = ", ".join(map(str, (500, 501, 320, 200, *coefficients)))
    camera = CameraModel(640, 400, 500.0, 501.0, 320.0, 200.0, "none", ())
    text = foreign_files.mrcal(camera, model, [0.1, 0.2, 0.3, 1.0, 2.0, 3.0])
    file.write_text(text.replace("[500.0, 501.0, 320.0, 200.0]", f"[{numbers}]"))
    found = mrcal.read(file)
    assert (found.names, found.reference) == (("cam-0",), 0)
    assert found.cameras[0].lens == lens
    assert found.cameras[0].coefficients[: len(coefficients)] == coefficients[:8]
    assert found.cam_from_reference[0].translation_mm.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "model",
    [
        "LENSMODEL_CAHVOR",
        "LENSMODEL_CAHVORE_linearity=0.37",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=12_fov_x_deg=100",
    ],
)
def test_other_models_of_mrcal_are_told_with_its_converter(tmp_path: Path, model: str) -> None:
    camera = CameraModel(640, 400, 500.0, 501.0, 320.0, 200.0)
    (tmp_path / "a.cameramodel").write_text(foreign_files.mrcal(camera, model, [0.0] * 6))
    with pytest.raises(FormatError, match="mrcal-convert-lensmodel LENSMODEL_OPENCV8") as refused:
        mrcal.read(tmp_path)
    assert model in refused.value.found


def gen1() -> Float:
    """The numbers of a first-generation file."""
    left, right, rgb = (
        np.array([[f, 0, x], [0, f + 1, y], [0, 0, 1.0]])
        for f, x, y in ((790, 640, 400), (795, 641, 401), (1500, 960, 540))
    )
    half_turn = np.diag([-1.0, -1.0, 1.0])
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    lens = [0.125, 0.25, 0.5, 0.75, 0.0625] + [0.0] * 9
    parts = (
        np.eye(3), np.eye(3), left, right, half_turn, [-7.5, 1.0, 2.0], rgb, quarter,
        [3.75, -1.0, 0.5], lens, lens, [*lens[:5], 0.5, *[0.0] * 8],
    )  # fmt: skip
    return np.concatenate([np.ravel(part) for part in parts])


def test_the_first_generation_of_depthai_is_read_as_its_own_program_reads_it(
    tmp_path: Path,
) -> None:
    file = tmp_path / "depthai.calib"
    file.write_bytes(gen1().astype("<f4").tobytes())
    found = oak_gen1.read(file)
    assert (found.names, found.reference) == (("left", "right", "rgb"), 1)
    left, right, rgb = found.cameras
    assert (left.fx_px, left.fy_px, left.cx_px, left.cy_px) == (790.0, 791.0, 640.0, 400.0)
    assert (right.fx_px, rgb.fx_px, rgb.width_px, rgb.height_px) == (795.0, 1500.0, 1920, 1080)
    assert (left.lens, left.coefficients) == ("brown5", (0.125, 0.25, 0.5, 0.75, 0.0625))
    assert (rgb.lens, rgb.coefficients[5]) == ("brown8", 0.5)
    # Half a turn about z and (-75, 10, 20) mm from left to right; so back by (-75, 10, -20).
    back = found.cam_from_reference[0]
    assert back.translation_mm == pytest.approx([-75.0, 10.0, -20.0])
    assert back.rotation == pytest.approx(np.diag([-1.0, -1.0, 1.0]))
    onward = found.cam_from_reference[2]
    assert onward.translation_mm == pytest.approx([-37.5, 10.0, -5.0])
    assert onward.rotation[0] == pytest.approx([0.0, 1.0, 0.0])


@pytest.mark.parametrize("count", [440, 448])
def test_other_lengths_are_no_first_generation_of_depthai(tmp_path: Path, count: int) -> None:
    (tmp_path / "a.calib").write_bytes(b"\0" * count)
    with pytest.raises(FormatError, match="of 444 bytes"):
        oak_gen1.read(tmp_path / "a.calib")


angles = st.floats(-3.0, 3.0)


@settings(max_examples=50, deadline=None)
@given(vector=st.tuples(angles, angles, angles))
def test_quaternions_are_the_rotations_that_they_came_from(
    vector: tuple[float, float, float],
) -> None:
    rotation = Pose.from_vectors(np.array(vector), np.zeros(3)).rotation
    quaternion = quaternion_of(rotation)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0)
    assert quaternion[3] >= 0.0
    assert matrix_of(quaternion) == pytest.approx(rotation, abs=1e-12)
    assert matrix_of([2.0 * n for n in quaternion]) == pytest.approx(rotation, abs=1e-12)


def test_quaternions_have_their_sense() -> None:
    """A quarter turn about z takes x to y."""
    half = np.sqrt(0.5)
    assert matrix_of([0.0, 0.0, half, half])[:, 0] == pytest.approx([0.0, 1.0, 0.0])


lengths = st.floats(-200.0, 200.0)


@st.composite
def rigs(draw: st.DrawFn) -> RigGeometry:
    """Three views of one lens, anywhere."""
    lens = draw(st.sampled_from(sorted(LENSES)))
    coefficients = tuple(k * draw(st.floats(-1.0, 1.0)) for k in LENSES[lens])
    cameras = tuple(
        CameraModel(
            draw(st.integers(100, 2000)), draw(st.integers(100, 2000)),
            draw(st.floats(300.0, 3000.0)), draw(st.floats(300.0, 3000.0)),
            draw(st.floats(-10.0, 2000.0)), draw(st.floats(-10.0, 2000.0)), lens, coefficients,
        )
        for _ in range(3)
    )  # fmt: skip
    small = st.floats(-0.2, 0.2)
    poses = tuple(
        Pose.from_vectors(
            np.array(draw(st.tuples(small, small, angles))),
            np.array(draw(st.tuples(lengths, lengths, lengths))),
        )
        for _ in range(3)
    )
    return RigGeometry(("a", "b", "c"), 0, cameras, poses)


@SETTINGS
@given(told=rigs())
def test_any_rig_comes_through_every_file_of_these_tools(tmp_path: Path, told: RigGeometry) -> None:
    anipose.write(told, tmp_path / "calibration.toml")
    require_same(anipose.read(tmp_path / "calibration.toml"), told, (0, 1, 2))
    for old in (False, True):
        (tmp_path / "c.toml").write_text(foreign_files.caliscope(told, old=old))
        require_same(caliscope.read(tmp_path / "c.toml"), told, (0, 1, 2))
    foreign_files.colmap_binary(told, tmp_path, points=0)
    require_same(colmap.read(tmp_path), told, (0, 1, 2))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_half_turn_is_the_axis_itself(axis: int):
    half = -np.eye(3)
    half[axis, axis] = 1.0
    assert quaternion_of(half) == np.eye(4)[axis].tolist()
