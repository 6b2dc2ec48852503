"""What a device says about its own sensors, in mm."""

import json

import pytest
from rig_drivers.oak.calibration import calibration_fields, sensor_calibrations

from rig.errors import ConfigError
from tests.support.oak import oak_d


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
