"""Calibrations as other programs' versions and people write them, and files made to do harm."""

from pathlib import Path

import numpy as np
import pytest

from rig.bounded_text import MOST_BYTES, parse_toml, read_text
from rig.errors import ConfigError, FormatError
from rig.export.geometry_format import geometry_format
from rig.geometry.rig_geometry import RigGeometry
from rig.profile.load import load_profile

ROS = """
image_width: 800
image_height: 600
camera_name: {name}
camera_matrix: {{rows: 3, cols: 3, data: [400.5, 0, 399, 0, 401.5, 299, 0, 0, 1]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 4, data: [-0.1, 0.02, 0.001, -0.002]}}
rectification_matrix: {{rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}}
projection_matrix: {{rows: 3, cols: 4, data: [400, 0, 399, {offset}, 0, 400, 299, 0, 0, 0, 1, 0]}}
"""
LENS = (-0.1, 0.02, 0.001, -0.002, 0.0)


def read(name: str, path: Path) -> RigGeometry:
    return geometry_format(name).read(path)


def refusal(name: str, path: Path) -> str:
    with pytest.raises(FormatError) as refused:
        read(name, path)
    return str(refused.value)


def test_ros_lenses_of_four_numbers_have_no_k3(tmp_path: Path) -> None:
    (tmp_path / "left.yaml").write_text(ROS.format(name="left", offset=0))
    (tmp_path / "right.yaml").write_text(ROS.format(name="right", offset=-40))
    found = read("ros", tmp_path)
    assert found.names == ("left", "right")
    assert [camera.coefficients for camera in found.cameras] == [LENS, LENS]
    assert found.centres_mm()[1] == pytest.approx([100.0, 0.0, 0.0])


@pytest.mark.parametrize("numbers", ["[1, 2, 3]", "[1, 2, 3, 4, 5, 6]"])
def test_ros_lenses_of_other_lengths_are_told_with_what_is_expected(
    tmp_path: Path, numbers: str
) -> None:
    text = ROS.format(name="left", offset=0).replace("[-0.1, 0.02, 0.001, -0.002]", numbers)
    (tmp_path / "left.yaml").write_text(text)
    assert f"expected 5 numbers, found {numbers.count(',') + 1}" in refusal("ros", tmp_path)


@pytest.mark.parametrize("without", ["[0, 0, 399, -40, 0, 400,", "[400, 0, 399, -40, 0, 0,"])
def test_a_ros_projection_without_a_focal_length_is_told(tmp_path: Path, without: str) -> None:
    (tmp_path / "left.yaml").write_text(ROS.format(name="left", offset=0))
    right = ROS.format(name="right", offset=-40).replace("[400, 0, 399, -40, 0, 400,", without)
    (tmp_path / "right.yaml").write_text(right)
    assert "projection_matrix has no focal length" in refusal("ros", tmp_path)


def test_one_camera_info_file_is_one_view(tmp_path: Path) -> None:
    file = tmp_path / "ost.yaml"
    file.write_text(ROS.format(name="narrow_stereo/left", offset=0))
    found = read("ros", file)
    assert (found.names, found.reference) == (("narrow_stereo/left",), 0)
    camera = found.cameras[0]
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (400.5, 401.5, 399.0, 299.0)
    assert camera.coefficients == LENS


@pytest.mark.parametrize(
    ("there", "missing"), [("intrinsics", "extrinsics"), ("extrinsics", "intrinsics")]
)
@pytest.mark.parametrize("suffix", ["yml", "xml"])
def test_half_of_opencvs_sample_is_told_with_the_missing_file(
    tmp_path: Path, there: str, missing: str, suffix: str
) -> None:
    eye = np.eye(3)
    file = tmp_path / f"{there}.{suffix}"
    if there == "extrinsics":
        file.write_text(as_xml(R=eye, T=np.zeros((3, 1))))
    else:
        file.write_text(as_xml(M1=eye, D1=np.zeros((1, 5)), M2=eye, D2=np.zeros((1, 5))))
    told = f"holds {there}.{suffix} without {missing}.yml"
    assert told in refusal("opencv", tmp_path)
    assert told in refusal("opencv", file)


def matrix_xml(name: str, values: np.ndarray) -> str:
    rows, columns = values.shape
    data = " ".join(repr(float(value)) for value in values.ravel())
    return (
        f'<{name} type_id="opencv-matrix"><rows>{rows}</rows><cols>{columns}</cols>'
        f"<dt>d</dt><data>\n {data}</data></{name}>"
    )


def as_xml(**matrices: np.ndarray) -> str:
    inner = "".join(matrix_xml(name, values) for name, values in matrices.items())
    return f'<?xml version="1.0"?>\n<opencv_storage>\n{inner}\n</opencv_storage>\n'


def test_opencvs_sample_is_read_as_xml(tmp_path: Path) -> None:
    camera = np.array([[400.5, 0.0, 319.5], [0.0, 401.5, 239.5], [0.0, 0.0, 1.0]])
    lens = np.array([LENS])
    inside = as_xml(M1=camera, D1=lens, M2=camera, D2=lens)
    (tmp_path / "intrinsics.xml").write_text(inside)
    outside = as_xml(R=np.eye(3), T=np.array([[-60.0], [0.0], [0.0]]))
    (tmp_path / "extrinsics.xml").write_text(outside)
    found = read("opencv", tmp_path)
    assert found.cameras[1].coefficients == LENS
    assert (found.cameras[0].width_px, found.cameras[0].height_px) == (639, 479)
    assert found.centres_mm()[1] == pytest.approx([60.0, 0.0, 0.0])


def test_opencvs_rig_is_read_as_xml(tmp_path: Path) -> None:
    camera = np.array([[400.0, 0.0, 320.0], [0.0, 400.0, 240.0], [0.0, 0.0, 1.0]])
    view = "".join(
        matrix_xml(name, values)
        for name, values in (
            ("camera_matrix", camera),
            ("distortion_coefficients", np.zeros((1, 5))),
            ("rotation", np.eye(3)),
            ("translation_mm", np.zeros((3, 1))),
        )
    )
    (tmp_path / "rig.xml").write_text(
        "<opencv_storage><reference>one</reference><views><_><name>one</name>"
        "<image_width>640</image_width><image_height>480</image_height>"
        f'<distortion_model>"none"</distortion_model>{view}</_></views></opencv_storage>'
    )
    found = read("opencv", tmp_path)
    assert (found.names, found.cameras[0].lens) == (("one",), "none")
    assert (found.cameras[0].width_px, found.cameras[0].cx_px) == (640, 320.0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('<!DOCTYPE a [<!ENTITY b "c">]><opencv_storage/>', "defines entities"),
        ("<opencv_storage><a></opencv_storage>", "is no XML"),
        ("<other/>", "its root is other"),
    ],
)
def test_xml_that_is_not_opencvs_is_told(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "rig.xml").write_text(text)
    assert told in refusal("opencv", tmp_path)


CHAIN = """
cam{n}:
  camera_model: pinhole
  intrinsics: [400, 401, 320, 240]
  distortion_model: radtan
  distortion_coeffs: [-0.1, 0.02, 0.001, -0.002]
  resolution: [640, 480]
  {key}: [[0, -1, 0, {x}], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]]
"""


def test_a_kalibr_chain_by_an_imu_gives_the_places_of_the_cameras(tmp_path: Path) -> None:
    file = tmp_path / "chain.yaml"
    file.write_text("".join(CHAIN.format(n=n, key="T_cam_imu", x=-0.1 * n) for n in range(3)))
    found = read("kalibr", file)
    # cam n = turned and shifted from the IMU alike, but for 100 mm more in x each.
    assert found.centres_mm() == pytest.approx(
        np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [200.0, 0.0, 0.0]])
    )


def test_a_kalibr_chain_without_any_places_is_told(tmp_path: Path) -> None:
    file = tmp_path / "chain.yaml"
    file.write_text("".join(CHAIN.format(n=n, key="other", x=0.0) for n in range(2)))
    assert "has no T_cn_cnm1" in refusal("kalibr", file)


@pytest.mark.parametrize(
    ("model", "numbers", "focal_px", "lens"),
    [
        ("SIMPLE_RADIAL", "500 320.5 240.5 -0.1", (500.0, 500.0), (-0.1, 0.0, 0.0, 0.0, 0.0)),
        ("RADIAL", "500 320.5 240.5 -0.1 0.02", (500.0, 500.0), (-0.1, 0.02, 0.0, 0.0, 0.0)),
        ("SIMPLE_PINHOLE", "500 320.5 240.5", (500.0, 500.0), ()),
        ("OPENCV", "500 501 320.5 240.5 -0.1 0.02 0.003 0.004", (500.0, 501.0),
         (-0.1, 0.02, 0.003, 0.004, 0.0)),
    ],
)  # fmt: skip
def test_colmaps_simple_cameras(
    tmp_path: Path,
    model: str,
    numbers: str,
    focal_px: tuple[float, float],
    lens: tuple[float, ...],
) -> None:
    (tmp_path / "cameras.txt").write_text(f"1 {model} 640 480 {numbers}\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 left.png\n\n")
    camera = read("colmap", tmp_path).cameras[0]
    assert (camera.fx_px, camera.fy_px) == focal_px
    assert (camera.cx_px, camera.cy_px, camera.coefficients) == (320.0, 240.0, lens)


def test_another_camera_of_colmap_is_told_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "cameras.txt").write_text("1 FOV 640 480 500 500 320 240 0.5\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 left.png\n\n")
    told = refusal("colmap", tmp_path)
    assert "camera model FOV is not known" in told
    assert "SIMPLE_RADIAL" in told


def doubling(levels: int) -> str:
    lines = ["a0: &a0 [1, 2]"]
    lines += [f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}, *a{n - 1}]" for n in range(1, levels)]
    return "\n".join([*lines, f"cam0: *a{levels - 1}"])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (doubling(38), "expected named fields, found list"),
        ("cam0: " + "[" * 41 + "]" * 41, "more than 40 levels deep"),
        ("a: &a {b: 1}\ncam0:\n  <<: *a", "merge keys"),
        ("cam0: {intrinsics: [" + "1:" * 50 + "1]}", "is no number"),
        ("cam0: {intrinsics: [1" + "0" * 400 + "]}", "of 401 signs is no number"),
        ("cam0: {camera_model: !!python/name:os.system x}", "is no YAML"),
    ],
    ids=["doubled lists", "deep", "merged", "base 60", "long number", "code"],
)
def test_yaml_that_asks_for_the_world_is_told(tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "chain.yaml"
    file.write_text(text)
    assert told in refusal("kalibr", file)


def test_numbers_of_300_digits_are_none_of_a_camera(tmp_path: Path) -> None:
    file = tmp_path / "chain.yaml"
    text = CHAIN.format(n=0, key="rostopic", x=0.0)
    file.write_text(text.replace("[400,", "[1" + "0" * 301 + ","))
    assert "intrinsics: expected finite numbers, found int 10000" in refusal("kalibr", file)
    file.write_text(text.replace("[400,", "[400.0,"))
    assert read("kalibr", file).cameras[0].fx_px == 400.0


def test_yaml_may_be_forty_levels_deep(tmp_path: Path) -> None:
    file = tmp_path / "chain.yaml"
    file.write_text("cam0: " + "[" * 39 + "]" * 39)  # the mapping itself is a level
    assert "expected named fields" in refusal("kalibr", file)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a." * 20 + "a = 1", "more than 20 parts"),
        ("a = " + "[" * 5000 + "]" * 5000, "nested too deep"),
        ("a = " + "1" * 5000, "4300 digits"),
        ("a = ", "Invalid value"),
    ],
    ids=["long key", "deep", "long number", "no value"],
)
def test_toml_that_asks_for_the_world_is_told(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        parse_toml(text)
    profile = tmp_path / "p.toml"
    profile.write_text(text)
    with pytest.raises(ConfigError, match=told):
        load_profile(str(profile))


def test_keys_of_some_parts_are_read() -> None:
    assert parse_toml("a.'b c' . d = 1") == {"a": {"b c": {"d": 1}}}
    deep = parse_toml("a." * 19 + "a = 1")
    for _ in range(20):
        deep = deep["a"]
    assert deep == 1


def test_sentences_with_many_stops_are_no_long_key() -> None:
    text = "description = '" + "Stop here. And here. " * 30 + "'\n# " + "-" * 100_000
    assert list(parse_toml(text)) == ["description"]


def test_files_larger_than_any_real_one_are_told_with_the_bound(tmp_path: Path) -> None:
    file = tmp_path / "large.yaml"
    file.write_bytes(b" " * MOST_BYTES)
    assert len(read_text(file)) == MOST_BYTES
    file.write_bytes(b" " * (MOST_BYTES + 1))
    with pytest.raises(FormatError, match="larger than 4 MB"):
        read_text(file)
    profile = tmp_path / "large.toml"
    file.rename(profile)
    with pytest.raises(ConfigError, match="larger than 4 MB"):
        load_profile(str(profile))
    profile.write_text("[[views]]\n" * 10_000)
    with pytest.raises(ConfigError, match=r"views\.0\.name: missing"):
        load_profile(str(profile))
    profile.write_text("[[views]]\n" * 10_001)
    with pytest.raises(ConfigError, match="more than 20000 keys and values"):
        load_profile(str(profile))


@pytest.mark.slow
def test_files_of_more_values_than_any_are_told_before_they_cost_anything(tmp_path: Path) -> None:
    chain = tmp_path / "camchain.yaml"
    chain.write_text("cam0: [" + "0," * 10_000 + "]")
    with pytest.raises(FormatError, match="more than 10000 values"):
        geometry_format("kalibr").read(chain)
    (tmp_path / "a.cameramodel").write_text("[" + "0," * 20_001 + "]")
    with pytest.raises(FormatError, match="has more than 20000 entries"):
        geometry_format("mrcal").read(tmp_path)
    (tmp_path / "a.cameramodel").write_text("{'a': 1if 2 else 3}")
    with pytest.raises(FormatError, match="is no mrcal camera model"):
        geometry_format("mrcal").read(tmp_path)
    (tmp_path / "cameras.txt").write_text("\n" * 1001)
    with pytest.raises(FormatError, match="has 1001 lines, rigs have 1000 views at most"):
        geometry_format("colmap").read(tmp_path)
    (tmp_path / "cameras.txt").write_text("")
    (tmp_path / "images.txt").write_text("\n" * 2002)
    with pytest.raises(FormatError, match="holds 1001 images"):
        geometry_format("colmap").read(tmp_path)
    deep = "<a>" * 3000 + "</a>" * 3000
    (tmp_path / "rig.xml").write_text(f"<opencv_storage>{deep}</opencv_storage>")
    with pytest.raises(FormatError, match="is nested too deep"):
        geometry_format("opencv").read(tmp_path)


def test_long_texts_of_a_file_are_told_in_part() -> None:
    error = FormatError("a" * 700 + "b" * 700, advice="c" * 1201)
    assert error.found == "a" * 600 + " ... " + "b" * 600
    assert error.advice == "c" * 600 + " ... " + "c" * 600
    assert FormatError("d" * 1200).found == "d" * 1200
