"""The EEPROM is flashed only on purpose, with a way back."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.oak.calibration import sensor_calibrations
from drivers.oak.eeprom import Eeprom, eeprom_content, first_difference, parse_calibration
from drivers.oak.sdk import dai
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


@pytest.mark.parametrize("content", [{}, {"version": 7}, {"cameraData": 3}, {"cameraData": [[1]]}])
def test_what_describes_no_sensor_is_no_calibration(content: dict[str, Any]):
    with pytest.raises(ConfigError, match="calibration"):
        parse_calibration(content)


def test_an_image_survives_the_way_through_a_file(tmp_path: Path):
    path = tmp_path / "eeprom.json"
    path.write_text(json.dumps(eeprom_content(oak_d())))
    again = parse_calibration(json.loads(path.read_text()))
    assert first_difference(eeprom_content(again), eeprom_content(oak_d())) is None
    place = first_difference(eeprom_content(again), eeprom_content(oak_d(801.0)))
    assert place is not None
    assert place.startswith("cameraData[0][1].intrinsicMatrix[0][0]")
