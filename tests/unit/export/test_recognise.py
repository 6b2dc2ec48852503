"""Whose calibration a file is: by what it holds, whatever it is called."""

import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rig.errors import FormatError
from rig.export.formats import formats_of, written_formats
from rig.export.geometry_format import export_geometry, geometry_format
from rig.export.geometry_import import read_foreign
from rig.export.recognise import recognise
from rig.geometry.rig_geometry import RigGeometry
from tests.support import foreign_files
from tests.unit.export.test_formats import geometry_with

COEFFICIENTS = (-0.11, 0.06, 0.0011, -0.0007, 0.0)
WRITTEN = [name for name in formats_of("geometry") if name in written_formats()]


def geometry() -> RigGeometry:
    told = geometry_with("brown5", COEFFICIENTS)
    return RigGeometry(("CAM_A", "CAM_B", "CAM_C"), 1, told.cameras, told.cam_from_reference)


@pytest.mark.parametrize("name", WRITTEN)
def test_what_is_written_is_recognised_under_any_name(tmp_path: Path, name: str) -> None:
    out = export_geometry(geometry(), geometry_format(name), tmp_path / "out").path
    assert recognise(out).source == name
    assert read_foreign(out).source == name
    assert read_foreign(tmp_path / "out").source == name
    assert read_foreign(tmp_path / "out", name).source == name
    if out.is_dir() and name != "colmap":
        file = min(out.iterdir())
    else:
        file = out / "cameras.txt" if out.is_dir() else out
    renamed = tmp_path / "something.dat"
    renamed.write_bytes(file.read_bytes())
    assert recognise(renamed).source == name


def test_what_is_only_read_is_recognised_under_any_name(tmp_path: Path) -> None:
    told = geometry()
    file = tmp_path / "file"
    for name, text in {
        "zed": foreign_files.zed(told.cameras[0], told),
        "caliscope": foreign_files.caliscope(told),
        "mrcal": foreign_files.mrcal(told.cameras[0], "LENSMODEL_OPENCV5", [0.0] * 6),
    }.items():
        file.write_text(text)
        assert recognise(file).source == name
    file.write_text(foreign_files.caliscope(told, old=True))
    assert recognise(file).source == "caliscope"
    file.write_bytes(b"\0" * 444)
    assert recognise(file).source == "depthai"
    (tmp_path / "model").mkdir()
    foreign_files.colmap_binary(told, tmp_path / "model")
    assert recognise(tmp_path / "model").source == "colmap"
    assert recognise(tmp_path / "model" / "images.bin").source == "colmap"


@pytest.mark.parametrize(
    ("content", "what", "advice"),
    [
        (b"MATLAB 5.0 MAT-file, Platform", "a MATLAB workspace", "stereoParametersToOpenCV"),
        (b"\x93NUMPY\x01\x00", "arrays of NumPy", "cv2.FileStorage"),
        (b"PK\x03\x04 ...", "arrays of NumPy", "cv2.FileStorage"),
        (b"\x80\x04\x95", "a pickle of Python", "load it where it was made"),
        (b"<?xml?>\n<document version='1'>\n <chunk>", "Agisoft Metashape", "as COLMAP"),
        (b'{"value0": {"T_imu_cam": []}}', "Basalt", "Kalibr camchain"),
        (b'{"cameras": {}, "camera_poses": {}}', "multical", "cv2.FileStorage"),
        (b'{"board_config": {"name": "OAK"}}', "the description of a DepthAI", "device itself"),
        (b'{"boardConf": "nIR", "version": 7}', "the description of a DepthAI", "device itself"),
        (b"Model = CAHVOR = perspective", "a CAHVOR model", "mrcal-to-cameramodel"),
        (b'{"rectified.0.fx": "1"}', "librealsense", "ROS driver"),
        (b"hello", "of none of the formats", "--format"),
        (b"", "of none of the formats", "--format"),
    ],
)
def test_what_is_not_read_is_told_with_how_to_convert_it(
    tmp_path: Path, content: bytes, what: str, advice: str
) -> None:
    (tmp_path / "left.yaml").write_bytes(content)
    for path in (tmp_path, tmp_path / "left.yaml"):
        with pytest.raises(FormatError) as refused:
            recognise(path)
        assert what in refused.value.found
        assert advice in refused.value.advice


def test_a_folder_of_two_calibrations_is_told_with_both(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps({"cameraData": []}))
    (tmp_path / "b.yaml").write_text("cam0: {}\n")
    (tmp_path / "notes.txt").write_text("taken on Monday")
    with pytest.raises(FormatError, match=r"of depthai and kalibr \(a.json, b.yaml\)"):
        recognise(tmp_path)
    (tmp_path / "b.yaml").write_text('{"cameraData": []}')
    with pytest.raises(FormatError, match=r"2 calibrations of depthai \(a.json, b.yaml\)"):
        recognise(tmp_path)
    (tmp_path / "b.yaml").unlink()
    assert recognise(tmp_path).path == tmp_path / "a.json"
    assert recognise(tmp_path).source == "depthai"


def test_folders_without_a_calibration_are_told(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="holds no file"):
        recognise(tmp_path)
    for number in range(201):
        (tmp_path / f"{number}.txt").touch()
    with pytest.raises(FormatError, match="holds 201 files, a calibration 200 at most"):
        recognise(tmp_path)


def test_a_file_of_another_format_than_was_said_is_told_with_its_own(tmp_path: Path) -> None:
    file = export_geometry(geometry(), geometry_format("kalibr"), tmp_path).path
    with pytest.raises(FormatError, match="asked to read it as ros, found kalibr") as refused:
        read_foreign(file, "ros")
    assert refused.value.advice == "give --format kalibr, or leave --format out"


def test_a_damaged_file_of_the_format_that_was_said_is_told_as_damaged(tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text("cam0: 1\n")
    with pytest.raises(FormatError, match="cam0: expected named fields"):
        read_foreign(tmp_path / "c.yaml", "kalibr")
    (tmp_path / "c.yaml").write_text("nothing")
    with pytest.raises(FormatError, match="expected named fields, found str"):
        read_foreign(tmp_path / "c.yaml", "kalibr")


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=15, deadline=None
)
@given(content=st.binary(max_size=300) | st.text(max_size=300).map(lambda text: text.encode()))
def test_any_file_is_recognised_or_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "file").write_bytes(content)
    try:
        found = recognise(tmp_path / "file").source
    except FormatError as error:
        assert error.advice
    else:
        assert found in formats_of("geometry")


@pytest.mark.parametrize(
    "content",
    [
        b"\n" * 200_000, b" " * 200_000, b"<document" * 20_000, b"1 " + b"A_" * 100_000,
        b"\n Model" * 20_000, b'"board_config"' * 10_000,
    ],
    ids=["lines", "blanks", "tags", "words", "models", "keys"],
)  # fmt: skip
def test_files_that_repeat_the_beginning_of_a_sign_take_no_time(
    tmp_path: Path, content: bytes
) -> None:
    """Signs that look back over and over would take hours here."""
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(FormatError, match="of none of the formats"):
        recognise(tmp_path / "file")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"distortions=" + b"[" * 100_000, "more than 20000 keys and values"),
        (b"distortions=" + b"{a=" * 5_000, "nested too deep"),
        (b"distortions=1" + b"0" * 5_000, "4300 digits"),
        (b'{"a":{"type_id":"opencv-matrix"},"b":' + b'{"a":' * 100_000, "is no JSON"),
        (b"<opencv_storage>" + b"<a>" * 60_000, "is no XML"),
        (b"[LEFT_CAM_HD]\n" + b"a=1\n" * 30_000, "larger than 0.1 MB"),
        (b"{'lensmodel': 9**9**9}", "is no mrcal camera model"),
        (b"{'lensmodel': b'" + b"x" * 5_000_000 + b"'}", "lensmodel must be text"),
    ],
    ids=["lists", "tables", "digits", "JSON", "XML", "INI", "power", "bytes"],
)
def test_files_that_ask_for_the_world_are_told(tmp_path: Path, content: bytes, says: str) -> None:
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(FormatError, match=says):
        read_foreign(tmp_path / "file")
