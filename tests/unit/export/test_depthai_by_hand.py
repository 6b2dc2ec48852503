"""Files of a device written by hand, and what they must come to, number by number."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.errors import FormatError
from rig.export import depthai
from rig.geometry.rig_geometry import RigGeometry
from tests.unit.export.test_formats import LENSES, SOCKETS, geometry_with

EYE = np.eye(3).tolist()


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
        (1, [0.1] * 5, "of a fisheye, expected 4"),
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
