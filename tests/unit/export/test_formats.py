"""Every format against its own reader, against other people's readers, and against nonsense."""

import json
import subprocess
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from shutil import which

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rig.errors import ConfigError, FormatError, StoreError
from rig.export import depthai
from rig.export.agreement import aligned, largest_gap_px
from rig.export.formats import format_named, formats_of
from rig.export.geometry_format import export_geometry, geometry_format
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from tests.support.foreign_files import caliscope, zed
from tests.support.shared_data import SHARED

FORMATS = {name: geometry_format(name) for name in formats_of("geometry")}
LENSES: dict[LensModel, tuple[float, ...]] = {
    "none": (),
    "brown5": (-0.11, 0.06, 0.0011, -0.0007, -0.01),
    "brown8": (0.21, -0.05, 0.0006, 0.0004, 0.012, 0.31, -0.04, 0.02),
    "fisheye": (-0.02, 0.006, -0.003, 0.0008),
}
SOCKETS = {"centre": "CAM_A", "left": "CAM_B", "top": "CAM_D"}


def geometry_with(lens: LensModel, coefficients: tuple[float, ...] | None = None) -> RigGeometry:
    """Three views, none of them simple; the reference is the second."""
    given_lens = LENSES[lens] if coefficients is None else coefficients
    cameras = tuple(
        CameraModel(1280, 800, 881.3 + i, 879.9 - i, 637.2 + 3 * i, 402.8, lens, given_lens)
        for i in range(3)
    )
    poses = (
        Pose.from_vectors(np.array([0.01, -0.02, 0.03]), np.array([75.1, -0.4, 0.9])),
        Pose.identity(),
        Pose.from_vectors(np.array([-0.015, 0.005, 1.57]), np.array([0.7, 74.6, -1.3])),
    )
    return RigGeometry(("left", "centre", "top"), 1, cameras, poses)


CASES = [
    (name, lens)
    for name, target in FORMATS.items()
    for lens in LENSES
    if lens in target.holds or (lens == "brown5" and "brown4" in target.holds)
]


@pytest.mark.parametrize(("name", "lens"), CASES)
def test_what_is_written_is_read_back(tmp_path: Path, name: str, lens: LensModel) -> None:
    coefficients = (-0.11, 0.06, 0.0011, -0.0007, 0.0) if name == "kalibr" else None
    geometry = geometry_with(lens, coefficients if lens == "brown5" else None)
    sockets = SOCKETS if name == "depthai" else None

    def with_sockets(written: RigGeometry, path: Path) -> None:
        depthai.write(written, path, sockets=SOCKETS)

    exported = export_geometry(
        geometry, FORMATS[name], tmp_path / "out",
        write=with_sockets if sockets else None, read_names=sockets,
    )  # fmt: skip
    assert exported.gap_px < 1e-6
    assert not exported.refits


def test_the_comparison_sees_a_difference() -> None:
    one = geometry_with("brown5")
    moved = Pose(np.eye(3), np.array([0.0, 0.0, 0.0]))
    other = RigGeometry(one.names, 1, one.cameras, (one.cam_from_reference[0], moved, moved))
    assert largest_gap_px(one, one) < 1e-9
    assert largest_gap_px(one, other) > 1.0


def test_another_order_and_reference_is_the_same_rig() -> None:
    one = geometry_with("brown5")
    turned = aligned(one, ("top", "left", "centre"), "top")
    assert largest_gap_px(aligned(turned, one.names, "centre"), one) < 1e-9
    with pytest.raises(FormatError, match="asked for the views"):
        aligned(one, ("a", "b", "c"), "a")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "lens"), [("kalibr", "brown8"), ("mrcal", "fisheye")])
def test_a_lens_that_does_not_fit_is_refused_or_fitted_with_its_error(
    tmp_path: Path, name: str, lens: LensModel
) -> None:
    geometry = geometry_with(lens)
    with pytest.raises(FormatError, match="--refit"):
        export_geometry(geometry, FORMATS[name], tmp_path)
    exported = export_geometry(geometry, FORMATS[name], tmp_path, may_refit=True)
    for view, fitted in exported.refits.items():
        original = geometry.cameras[geometry.names.index(view)]
        pixels = np.random.default_rng(1).uniform((0, 0), (1279, 799), (500, 2))
        points = np.column_stack([original.unproject(pixels), np.ones(500)])
        apart = np.linalg.norm(fitted.camera.project(points) - pixels, axis=1)
        assert apart.max() <= 1.05 * fitted.largest_px
        assert fitted.rms_px < fitted.largest_px < 5.0
    assert set(exported.refits) == set(geometry.names)


def test_depthai_reads_our_json(tmp_path: Path) -> None:
    if find_spec("depthai") is None:
        pytest.skip("the extra `oak` is not installed")
    from rig_drivers.oak.sdk import dai  # with its side effects off

    geometry = geometry_with("brown5")
    path = tmp_path / "calibration.json"
    depthai.write(geometry, path, sockets=SOCKETS)
    handler = dai.CalibrationHandler(path)
    socket = {"left": dai.CameraBoardSocket.CAM_B, "centre": dai.CameraBoardSocket.CAM_A,
              "top": dai.CameraBoardSocket.CAM_D}  # fmt: skip
    for name, camera, pose in zip(
        geometry.names, geometry.cameras, geometry.cam_from_reference, strict=True
    ):
        matrix = np.array(handler.getCameraIntrinsics(socket[name], 1280, 800))
        assert matrix == pytest.approx(camera.matrix, rel=1e-6)
        found = handler.getDistortionCoefficients(socket[name])[:5]
        assert found == pytest.approx(camera.coefficients, abs=1e-7)
        if name == "centre":
            continue
        chained = np.array(handler.getCameraExtrinsics(socket["centre"], socket[name], False))
        assert chained[:3, :3] == pytest.approx(pose.rotation, abs=1e-6)
        assert 10.0 * chained[:3, 3] == pytest.approx(pose.translation_mm, abs=1e-4)


def test_what_a_device_knows_besides_is_kept(tmp_path: Path) -> None:
    device = tmp_path / "device.json"
    device.write_text(json.dumps({"boardName": "NG9097", "imuExtrinsics": {"lengthUnit": 1}}))
    depthai.write(geometry_with("brown5"), tmp_path / "c.json", sockets=SOCKETS, device=device)
    content = json.loads((tmp_path / "c.json").read_text())
    assert content["boardName"] == "NG9097"
    assert content["imuExtrinsics"] == {"lengthUnit": 1}
    assert len(content["cameraData"]) == 3


def test_depthai_wants_a_socket_for_every_view(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="--socket left=CAM_A"):
        depthai.write(geometry_with("brown5"), tmp_path / "c.json")


@pytest.mark.parametrize("lens", ["none", "brown5", "brown8", "fisheye"])
def test_colmap_reads_our_model(tmp_path: Path, lens: LensModel) -> None:
    pycolmap = pytest.importorskip("pycolmap", reason="pycolmap is not installed")
    geometry = geometry_with(lens)
    export_geometry(geometry, FORMATS["colmap"], tmp_path)
    model = pycolmap.Reconstruction(str(tmp_path))
    points = np.random.default_rng(2).uniform((-300, -200, 700), (300, 200, 900), (50, 3))
    for image in model.images.values():
        view = geometry.names.index(Path(image.name).stem)
        ours = geometry.project(view, points)
        theirs = np.array([image.project_point(p / 1000.0) for p in points]) - 0.5
        assert theirs == pytest.approx(ours, abs=1e-6)


def _has_mrcal() -> bool:
    python = which("python3", path="/usr/bin")
    if python is None:
        return False
    asked = subprocess.run([python, "-c", "import mrcal"], capture_output=True, check=False)
    return asked.returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("lens", ["none", "brown5", "brown8"])
def test_mrcal_reads_our_models(tmp_path: Path, lens: LensModel) -> None:
    if not _has_mrcal():
        pytest.skip("Debian's package python3-mrcal is not installed")
    geometry = geometry_with(lens)
    export_geometry(geometry, FORMATS["mrcal"], tmp_path)
    points = np.random.default_rng(2).uniform((-300, -200, 700), (300, 200, 900), (50, 3))
    np.save(tmp_path / "points.npy", points / 1000.0)
    program = (
        "import sys, mrcal, numpy as np; m = mrcal.cameramodel(sys.argv[1]);"
        "p = mrcal.transform_point_rt(m.extrinsics_rt_fromref(), np.load(sys.argv[2]));"
        "np.save(sys.argv[3], mrcal.project(p, *m.intrinsics()))"
    )
    for view, name in enumerate(geometry.names):
        files = [str(tmp_path / f) for f in (f"{name}.cameramodel", "points.npy", "pixels.npy")]
        subprocess.run(["/usr/bin/python3", "-c", program, *files], check=True, capture_output=True)
        assert np.load(files[2]) == pytest.approx(geometry.project(view, points), abs=1e-6)


def test_opencv_reads_our_pair(tmp_path: Path) -> None:
    whole = geometry_with("brown5")
    pair = RigGeometry(whole.names[:2], 1, whole.cameras[:2], whole.cam_from_reference[:2])
    export_geometry(pair, FORMATS["opencv"], tmp_path)
    inside = cv2.FileStorage(str(tmp_path / "intrinsics.yml"), cv2.FILE_STORAGE_READ)
    outside = cv2.FileStorage(str(tmp_path / "extrinsics.yml"), cv2.FILE_STORAGE_READ)
    points = np.random.default_rng(2).uniform((-300, -200, 700), (300, 200, 900), (50, 3))
    in_left = pair.cam_from_reference[0].apply(points)
    rotation, translation = outside.getNode("R").mat(), outside.getNode("T").mat()
    found, _ = cv2.projectPoints(
        in_left, cv2.Rodrigues(rotation)[0], translation,
        inside.getNode("M2").mat(), inside.getNode("D2").mat(),
    )  # fmt: skip
    assert np.asarray(found).reshape(-1, 2) == pytest.approx(pair.project(1, points), abs=1e-9)


def flat_geometry() -> RigGeometry:
    """As `geometry_with`, but with all optical centres in one plane, as a projection matrix is."""
    whole = geometry_with("brown5")
    placed = tuple(
        Pose(pose.rotation, -pose.rotation @ (pose.centre_mm * (1.0, 1.0, 0.0)))
        for pose in whole.cam_from_reference
    )
    return RigGeometry(whole.names, 1, whole.cameras, placed)


def test_ros_projection_matrices_are_those_of_rectified_pictures(tmp_path: Path) -> None:
    """What a ROS node does: undistort, turn by R, project by P."""
    geometry = flat_geometry()
    export_geometry(geometry, FORMATS["ros"], tmp_path)
    points = np.random.default_rng(2).uniform((-200, -150, 700), (200, 150, 900), (50, 3))
    for view, name in enumerate(geometry.names):
        info = yaml.safe_load((tmp_path / f"{name}.yaml").read_text())
        turn, projection = (
            np.array(info[key]["data"]).reshape(3, -1)
            for key in ("rectification_matrix", "projection_matrix")
        )
        rectified = cv2.undistortPoints(
            geometry.project(view, points), np.array(info["camera_matrix"]["data"]).reshape(3, 3),
            np.array(info["distortion_coefficients"]["data"]), R=turn, P=projection,
            criteria=(cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-12),
        )  # fmt: skip
        reference = yaml.safe_load((tmp_path / "centre.yaml").read_text())
        common = np.array(reference["rectification_matrix"]["data"]).reshape(3, 3)
        places = np.column_stack([points @ common.T / 1000.0, np.ones(len(points))])
        homogeneous = places @ projection.T
        expected = homogeneous[:, :2] / homogeneous[:, 2:]
        assert np.asarray(rectified).reshape(-1, 2) == pytest.approx(expected, abs=1e-5)


def test_ros_places_come_from_projections_where_there_are_no_transforms(tmp_path: Path) -> None:
    flat = flat_geometry()
    export_geometry(flat, FORMATS["ros"], tmp_path)
    (tmp_path / "transforms.yaml").unlink()
    back = aligned(FORMATS["ros"].read(tmp_path), flat.names, "centre")
    assert largest_gap_px(flat, back) < 1e-6


@pytest.mark.skipif(
    not (SHARED / "checkerboard-stereo").is_dir(), reason=f"not in {SHARED}; set RIG_SHARED_DATA"
)
def test_the_stereo_sample_of_opencv_is_read() -> None:
    geometry = FORMATS["opencv"].read(SHARED / "checkerboard-stereo")
    assert geometry.names == ("left", "right")
    assert 300.0 < geometry.cameras[0].fx_px < 3000.0


@pytest.mark.parametrize("name", FORMATS)
def test_missing_files_are_a_clear_error(tmp_path: Path, name: str) -> None:
    with pytest.raises((FormatError, StoreError), match=str(tmp_path)):
        FORMATS[name].read(tmp_path / "nothing")


def test_unknown_formats_are_named() -> None:
    with pytest.raises(ConfigError, match="known are ros"):
        format_named("xyz")


FILES: dict[str, str] = {
    "ros": "left.yaml", "kalibr": "camchain.yaml", "opencv": "rig.yml",
    "depthai": "calibration.json", "mrcal": "left.cameramodel", "colmap": "images.txt",
    "anipose": "calibration.toml", "caliscope": "camera_array.toml", "zed": "SN1.conf",
}  # fmt: skip


JUNK = [b"", b"nan", b"-1", b"1e400", b"[", b"}", b": x", b"\n", b"\xff", b"null", b"'", b"0"]


def written_elsewhere(name: str, geometry: RigGeometry, folder: Path) -> Path:
    """A file of a tool that is only read here."""
    path = folder / FILES[name]
    text = caliscope(geometry) if name == "caliscope" else zed(geometry.cameras[0], geometry)
    path.write_text(text)
    return path


def spoil(name: str, folder: Path, change: Callable[[bytes], bytes]) -> None:
    """Write a good export, change one of its files, and read it."""
    coefficients = (-0.11, 0.06, 0.0011, -0.0007, 0.0)
    target = FORMATS[name]
    path = folder / target.path if target.path else folder
    if name == "depthai":
        depthai.write(geometry_with("brown5", coefficients), path, sockets=SOCKETS)
    elif target.write is None:
        path = written_elsewhere(name, geometry_with("brown5", coefficients), folder)
    else:
        target.write(geometry_with("brown5", coefficients), path)
    file = folder / FILES[name]
    file.write_bytes(change(file.read_bytes()))
    try:
        target.read(path)
    except (FormatError, StoreError) as error:
        assert str(error)


@pytest.mark.parametrize("name", FORMATS)
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25, deadline=None
)
@given(junk=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_nonsense_is_a_format_error(tmp_path: Path, name: str, junk: bytes) -> None:
    spoil(name, tmp_path, lambda _: junk)


@pytest.mark.parametrize("name", FORMATS)
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25, deadline=None
)
@given(at=st.floats(0, 1), length=st.integers(0, 40), junk=st.sampled_from(JUNK))
def test_damage_is_a_format_error_or_reads(
    tmp_path: Path, name: str, at: float, length: int, junk: bytes
) -> None:
    def cut(content: bytes) -> bytes:
        start = int(at * len(content))
        return content[:start] + junk + content[start + length :]

    spoil(name, tmp_path, cut)


def test_the_reference_of_mrcal_is_the_view_that_is_not_turned(tmp_path: Path) -> None:
    one = geometry_with("none")
    turned = Pose.from_vectors(np.array([0.0, 0.0, 0.3]), np.zeros(3))
    geometry = RigGeometry(
        ("a", "b", "c"), 1, one.cameras, (turned, Pose.identity(), one.cam_from_reference[2])
    )
    export_geometry(geometry, FORMATS["mrcal"], tmp_path)
    found = FORMATS["mrcal"].read(tmp_path)
    assert found.names[found.reference] == "b"
    assert largest_gap_px(found, geometry) < 1e-6


@pytest.mark.parametrize("place", [5, 6, 7])
def test_a_single_rational_coefficient_is_kept_by_depthai(tmp_path: Path, place: int) -> None:
    coefficients = [0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    coefficients[place] = 0.02
    geometry = geometry_with("brown8", tuple(coefficients))
    depthai.write(geometry, tmp_path / "it.json", sockets=SOCKETS)
    cameras = FORMATS["depthai"].read(tmp_path / "it.json").cameras
    assert [camera.lens for camera in cameras] == ["brown8"] * 3
    assert cameras[0].coefficients == pytest.approx(coefficients)


def test_ros_files_begin_as_their_own_tools_write_them(tmp_path: Path) -> None:
    export_geometry(geometry_with("brown5"), FORMATS["ros"], tmp_path)
    lines = (tmp_path / "left.yaml").read_text().splitlines()
    assert lines[0].startswith("image_width: ")
    assert lines[1].startswith("image_height: ")
    assert lines[2] == "camera_name: left"
