"""The EEPROM is flashed only on purpose, with a way back."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_drivers.oak.calibration import sensor_calibrations
from rig_drivers.oak.eeprom import Eeprom, eeprom_content, first_difference, parse_calibration
from rig_drivers.oak.sdk import dai

from rig.errors import ConfigError, DeviceLostError
from rig.export.depthai import write
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from tests.support.oak import oak_d

B = dai.CameraBoardSocket.CAM_B


class FakeDevice:
    """An EEPROM."""

    def __init__(
        self, *, forgets: bool = False, refuses: bool = False, blank: bool = False
    ) -> None:
        self.holds: dai.CalibrationHandler | None = None if blank else oak_d()
        self.flashed = 0
        self._forgets = forgets
        self._refuses = refuses

    def getDeviceId(self) -> str:  # noqa: N802
        return "1844"

    def readCalibration2(self) -> dai.CalibrationHandler:  # noqa: N802
        if self.holds is None:
            raise RuntimeError("no calibration")
        return self.holds

    def flashCalibration(self, arg0: dai.CalibrationHandler) -> None:  # noqa: N802
        self.flashed += 1
        if self._refuses:
            raise RuntimeError("write protected")
        if not self._forgets:
            self.holds = arg0


def test_flashing_without_permission_touches_nothing(tmp_path: Path):
    device, backup = FakeDevice(), tmp_path / "before.json"
    with pytest.raises(ConfigError, match="say so with --flash"):
        Eeprom(device).flash(eeprom_content(oak_d(810.0)), backup, may_flash=False)
    assert device.flashed == 0
    assert not backup.exists()


def test_flashing_saves_writes_and_reads_back_and_the_backup_leads_home(tmp_path: Path):
    device, backup = FakeDevice(), tmp_path / "before.json"
    Eeprom(device).save(backup)
    Eeprom(device).flash(eeprom_content(oak_d(810.0)), backup, may_flash=True)
    assert device.holds is not None
    assert device.holds.getCameraIntrinsics(B)[0][0] == 810.0
    before = json.loads(backup.read_text())
    assert first_difference(before, eeprom_content(oak_d())) is None
    Eeprom(device).save(tmp_path / "between.json")
    Eeprom(device).flash(before, tmp_path / "between.json", may_flash=True)
    assert device.holds.getCameraIntrinsics(B)[0][0] == 800.0


def test_an_exported_calibration_replaces_the_cameras_and_nothing_else(tmp_path: Path):
    bent = (0.1, -0.2, 0.0, 0.0, 0.01)
    camera = CameraModel(1280, 800, 820.0, 821.0, 639.0, 399.0, "brown5", bent)
    right = Pose(np.eye(3), np.array([-74.8, 0.1, 0.2]))
    rig = RigGeometry(("left", "right"), 0, (camera, camera), (Pose.identity(), right))
    device, backup, out = FakeDevice(), tmp_path / "before.json", tmp_path / "calibration.json"
    Eeprom(device).save(backup)
    write(rig, out, sockets={"left": "CAM_B", "right": "CAM_C"}, device=backup)
    Eeprom(device).flash(json.loads(out.read_text()), backup, may_flash=True)
    assert device.holds is not None
    assert device.holds.getEepromData().boardName == "OAK-D"
    _, found = sensor_calibrations(device.holds, ["CAM_B", "CAM_C"])
    assert found.camera_matrix_px[0] == pytest.approx((820.0, 0.0, 639.0))
    assert found.translation_mm == pytest.approx((74.8, -0.1, -0.2), abs=1e-5)


def test_a_backup_is_never_overwritten(tmp_path: Path):
    device, backup = FakeDevice(), tmp_path / "before.json"
    backup.write_text("precious")
    with pytest.raises(ConfigError, match=r"File exists.*nothing was flashed"):
        Eeprom(device).save(backup)
    assert backup.read_text() == "precious"


@pytest.mark.parametrize("content", [None, "no json", "[1]", '{"version": 7}'])
def test_without_a_backup_of_what_is_there_nothing_is_flashed(tmp_path: Path, content: str | None):
    device, backup = FakeDevice(), tmp_path / "before.json"
    if content is not None:
        backup.write_text(content)
    with pytest.raises(ConfigError, match="nothing was flashed"):
        Eeprom(device).flash(eeprom_content(oak_d(810.0)), backup, may_flash=True)
    assert device.flashed == 0


def test_a_blank_eeprom_cannot_be_saved_and_so_not_flashed(tmp_path: Path):
    with pytest.raises(ConfigError, match="nothing to go back to"):
        Eeprom(FakeDevice(blank=True)).save(tmp_path / "before.json")


@pytest.mark.parametrize(
    ("device", "says"),
    [
        (FakeDevice(refuses=True), "write protected"),
        (FakeDevice(forgets=True), r"reads back another one at cameraData\[0\]"),
    ],
    ids=["refuses", "forgets"],
)
def test_what_goes_wrong_says_where_the_old_calibration_is(
    tmp_path: Path, device: FakeDevice, says: str
):
    backup = tmp_path / "before.json"
    Eeprom(device).save(backup)
    with pytest.raises(DeviceLostError, match=says) as caught:
        Eeprom(device).flash(eeprom_content(oak_d(810.0)), backup, may_flash=True)
    assert device.flashed == 1
    assert str(backup) in str(caught.value)


def changed(path: tuple[str | int, ...], value: object) -> dict[str, object]:
    """The image of an OAK-D with one place changed; `...` takes it away."""
    content: Any = json.loads(json.dumps(eeprom_content(oak_d())))
    node = content
    for step in path[:-1]:
        node = node[step]
    if value is ...:
        del node[path[-1]]
    else:
        node[path[-1]] = value
    return content


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        (("cameraData",), [], "cameraData describes no sensor"),
        (("cameraData",), 3, "cameraData describes no sensor"),
        (("cameraData", 0), [1], r"cameraData\[0\] is no pair"),
        (("cameraData", 1, 0), 1, "names socket 1, which is none or came before"),
        (("cameraData", 1, 0), 77, "names socket 77"),
        (("cameraData", 0, 1), None, r"cameraData\[0\]\[1\] is no object"),
        (("cameraData", 0, 1, "intrinsicMatrix"), ..., "intrinsicMatrix is no 3 x 3"),
        (("cameraData", 0, 1, "intrinsicMatrix", 1), [0.0, 1.0], "intrinsicMatrix is no 3 x 3"),
        (("cameraData", 0, 1, "intrinsicMatrix", 1), 4.0, "intrinsicMatrix is no list"),
        (("cameraData", 0, 1, "intrinsicMatrix", 0, 0), -1.0, "not positive"),
        (("cameraData", 0, 1, "intrinsicMatrix", 0, 2), float("nan"), "no number that an EEPROM"),
        (("cameraData", 0, 1, "width"), 0, "width is no whole number from 1 on"),
        (("cameraData", 0, 1, "distortionCoeff"), [0.0] * 15, "has 15 numbers, 14 are known"),
        (("cameraData", 0, 1, "distortionCoeff", 2), "x", "distortionCoeff is no number"),
        (("cameraData", 1, 1, "extrinsics", "translation", "x"), ..., "translation.x is no number"),
        (("cameraData", 1, 1, "extrinsics", "rotationMatrix"), [], "rotationMatrix is no 3 x 3"),
        (("cameraData", 1, 1, "extrinsics", "toCameraSocket"), 5, "towards socket 5"),
        (("cameraData", 1, 1, "extrinsics", "toCameraSocket"), 2, "in a circle"),
    ],
)
def test_what_the_library_would_take_is_refused_with_its_place(
    path: tuple[str | int, ...], value: object, says: str
):
    with pytest.raises(ConfigError, match=f"no calibration of an OAK device: .*{says}"):
        parse_calibration(changed(path, value))


places = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["x", "cameraData", "extrinsics", "width"]), inner)
    ),
    max_leaves=8,
)


@settings(deadline=None, max_examples=50)
@given(place=st.sampled_from(["cameraData", "imuExtrinsics", "version", "boardName"]), junk=places)
def test_any_data_is_a_calibration_or_an_error_of_ours(place: str, junk: object):
    try:
        parse_calibration(changed((place,), junk))
    except ConfigError as error:
        assert "OAK device" in str(error)


def test_an_image_survives_the_way_through_a_file(tmp_path: Path):
    path = tmp_path / "eeprom.json"
    path.write_text(json.dumps(eeprom_content(oak_d())))
    again = parse_calibration(json.loads(path.read_text()))
    assert first_difference(eeprom_content(again), eeprom_content(oak_d())) is None
    place = first_difference(eeprom_content(again), eeprom_content(oak_d(801.0)))
    assert place is not None
    assert place.startswith("cameraData[0][1].intrinsicMatrix[0][0]")
