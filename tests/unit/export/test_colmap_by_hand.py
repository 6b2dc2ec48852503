"""Files of COLMAP written by hand, and what they must come to, number by number."""

from pathlib import Path

import numpy as np
import pytest

from rig.errors import FormatError
from rig.export.geometry_format import geometry_format
from rig.geometry.rig_geometry import RigGeometry

EYE = np.eye(3).tolist()


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
        ("PINHOLE 640 400 500 501 320 200", ["1 1 0 0 0 0 0 0 2 a.png"], "camera 2 is not in cam"),
        ("PINHOLE 640 400 500 501 320 200", ["1 0.98 0 0 0 0 0 0 1 a.png"], "length 0.98"),
        ("PINHOLE 640 400 500 501 320 200", ["1 1.02 0 0 0 0 0 0 1 a.png"], "length 1.02"),
        ("PINHOLE 640 400 500 501 320 200", [], "0 images of 0 views"),
        ("PINHOLE 640 400 500 501 320 200", [AT_HOME, AT_HOME], "2 images of 1 views"),
        ("PINHOLE 640 400 500 501 320", [AT_HOME], "expected 4 numbers, found 3"),
        ("PINHOLE 640", [AT_HOME], "expected id, model, width, height"),
        ("FOV 640 400 500 501 320 200 1", [AT_HOME], "camera model FOV is not known"),
        ("THIN 640 400 1", [AT_HOME], "camera model THIN is not known"),
    ],
)
def test_what_colmap_does_not_write_is_refused(
    tmp_path: Path, camera: str, images: list[str], says: str
) -> None:
    with pytest.raises(FormatError, match=says):
        colmap(tmp_path, camera, *images)
