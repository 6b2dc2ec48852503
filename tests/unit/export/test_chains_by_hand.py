"""Files of Kalibr, mrcal and OpenCV written by hand, and what they must come to."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.errors import FormatError
from rig.export.geometry_format import geometry_format
from rig.geometry.rig_geometry import RigGeometry
from tests.unit.export.test_formats import geometry_with

EYE = np.eye(3).tolist()


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
        ([0.1] + [0.0] * 6 + [0.8] + [0.0] * 4, "brown8", (0.1, 0, 0, 0, 0, 0, 0, 0.8)),
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
        write = geometry_format("opencv").write
        assert write is not None
        write(geometry, tmp_path / name)
        return (tmp_path / name / "extrinsics.yml").exists()

    pair = RigGeometry(whole.names[:2], 1, whole.cameras[:2], whole.cam_from_reference[:2])
    assert written(pair, "pair")
    assert not written(whole, "three")
    assert not written(replace(pair, cameras=(fish[0], pair.cameras[1])), "half")
