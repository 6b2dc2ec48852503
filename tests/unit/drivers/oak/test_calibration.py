"""The EEPROM's calibration: read in mm, flashed only on purpose, with a way back."""

import json
from pathlib import Path
from typing import Any

import pytest

from drivers.oak.calibration import (
    calibration_fields,
    eeprom_content,
    first_difference,
    flash_calibration,
    parse_calibration,
    sensor_calibrations,
)
from drivers.oak.sdk import dai
from rig.errors import ConfigError, DeviceLostError
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


def test_lengths_are_read_in_mm_and_intrinsics_for_the_full_size():
    left, right = sensor_calibrations(oak_d(), ["CAM_B", "CAM_C"])
    assert right.translation_mm == pytest.approx((75.0, 0.0, 0.0))
    assert left.translation_mm == (0.0, 0.0, 0.0)
    assert right.towards == "CAM_B"
    assert (right.width_px, right.height_px) == (1280, 800)
    assert right.camera_matrix_px[0] == pytest.approx((800.0, 0.0, 640.5))
    assert right.distortion == pytest.approx([0.01 * k for k in range(14)], rel=1e-6)
    assert right.model == "Perspective"


def test_a_sensor_without_calibration_is_named():
    with pytest.raises(ConfigError, match="no calibration of CAM_D"):
        sensor_calibrations(oak_d(), ["CAM_B", "CAM_D"])


def test_the_identity_carries_what_the_device_knew():
    fields = calibration_fields(oak_d(), ["CAM_B", "CAM_C", "CAM_D"])
    assert fields["calibration CAM_D"] == "none"
    right = json.loads(fields["calibration CAM_C"])
    assert right["translation_mm"] == [75.0, 0.0, 0.0]
    assert right["distortion"][1] == 0.01


def test_flashing_without_permission_touches_nothing(tmp_path: Path):
    device, backup = FakeDevice(), tmp_path / "before.json"
    with pytest.raises(ConfigError, match="say so with --flash"):
        flash_calibration(device, eeprom_content(oak_d(810.0)), backup, may_flash=False)
    assert device.flashed == 0
    assert not backup.exists()


def test_flashing_saves_writes_and_reads_back_and_the_backup_leads_home(tmp_path: Path):
    device, backup = FakeDevice(), tmp_path / "before.json"
    flash_calibration(device, eeprom_content(oak_d(810.0)), backup, may_flash=True)
    assert device.holds is not None
    assert device.holds.getCameraIntrinsics(B)[0][0] == 810.0
    before = json.loads(backup.read_text())
    assert first_difference(before, eeprom_content(oak_d())) is None
    flash_calibration(device, before, tmp_path / "between.json", may_flash=True)
    assert device.holds.getCameraIntrinsics(B)[0][0] == 800.0


def test_a_backup_is_never_overwritten(tmp_path: Path):
    device, backup = FakeDevice(), tmp_path / "before.json"
    backup.write_text("precious")
    with pytest.raises(ConfigError, match="nothing was flashed"):
        flash_calibration(device, eeprom_content(oak_d(810.0)), backup, may_flash=True)
    assert backup.read_text() == "precious"
    assert device.flashed == 0


@pytest.mark.parametrize(
    ("device", "error", "says", "writes"),
    [
        (FakeDevice(blank=True), ConfigError, "cannot be read", 0),
        (FakeDevice(refuses=True), DeviceLostError, "write protected", 1),
        (
            FakeDevice(forgets=True),
            DeviceLostError,
            r"reads back another one at cameraData\[0\]",
            1,
        ),
    ],
    ids=["blank", "refuses", "forgets"],
)
def test_what_goes_wrong_says_where_the_old_calibration_is(
    tmp_path: Path, device: FakeDevice, error: type[Exception], says: str, writes: int
):
    backup = tmp_path / "before.json"
    with pytest.raises(error, match=says) as caught:
        flash_calibration(device, eeprom_content(oak_d(810.0)), backup, may_flash=True)
    assert device.flashed == writes
    assert (str(backup) in str(caught.value)) == (writes == 1)


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
