"""What a device says about its own sensors, in mm."""

import json

import pytest
from rig_drivers.oak.calibration import (
    calibration_fields,
    factory_cameras,
    sensor_calibrations,
)

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


def test_the_factory_calibration_is_that_of_the_pictures_that_are_taken():
    sockets = {"l": "CAM_B", "r": "CAM_C"}
    full = factory_cameras(oak_d(), sockets, dict.fromkeys(sockets, (1280, 800)))
    assert full is not None
    assert [camera.view for camera in full] == ["l", "r"]
    assert full[1].matrix_px[0] == pytest.approx((800.0, 0.0, 640.5))
    assert full[1].centre_mm == pytest.approx((75.0, 0.0, 0.0))
    assert not full[0].is_fisheye
    half = factory_cameras(oak_d(), sockets, dict.fromkeys(sockets, (640, 400)))
    assert half is not None
    # The middle of pixels 640 and 641 of the sensor becomes that of pixel 320.
    assert half[0].matrix_px[0] == pytest.approx((400.0, 0.0, (640.5 + 0.5) / 2 - 0.5))
    assert (half[0].width_px, half[0].height_px) == (640, 400)
    # 16:9 of 16:10: cut above and below, 40 rows of the sensor each.
    cut = factory_cameras(oak_d(), sockets, dict.fromkeys(sockets, (1280, 720)))
    assert cut is not None
    assert cut[0].matrix_px[1] == pytest.approx((0.0, 800.0, 400.5 - 40.0))


def test_a_device_that_does_not_know_all_its_sensors_knows_none():
    far = {"l": "CAM_B", "far": "CAM_D"}
    assert factory_cameras(oak_d(), far, dict.fromkeys(far, (1280, 800))) is None
