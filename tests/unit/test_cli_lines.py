"""Lines that verbs print, from values alone."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rig.cli import calibration_result, devices
from rig.discovery import Findings, FoundDevice
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry, StageGeometry


def depth_zero(stage: StageGeometry | None) -> str:
    camera = CameraModel(64, 48, 90.0, 90.0, 32.0, 24.0, "none", ())
    geometry = RigGeometry(("a", "b"), 1, (camera, camera), (Pose.identity(),) * 2, None, stage)
    result: Any = SimpleNamespace(calibration=SimpleNamespace(geometry=geometry))
    return calibration_result._depth_zero(result)


def test_depth_counts_from_the_reference_camera():
    said = depth_zero(None)
    assert "optical centre of b" in said
    assert "no stage took part" in said


def test_a_stage_ties_depth_to_its_zero_with_twice_its_sigma():
    covariance = np.diag([1.0, 1.0, 1.0, 0.0225])
    said = depth_zero(StageGeometry(np.array([0.0, 0.0, 1.0]), 1.0, 12.345, covariance))
    assert "at stage position 0 the target's middle is at 12.35 +- 0.30 mm (k=2)" in said


def test_a_device_is_listed_with_its_other_names_and_its_problem(
    capsys: pytest.CaptureFixture[str],
):
    well = FoundDevice("/dev/a", "a camera")
    ill = FoundDevice("/dev/b", "another", ("usb-b",), "may not be opened")
    devices._show(Findings("v4l2", "camera.devices", (well, ill), title="cameras"))
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        "cameras: 2 (camera.devices)",
        "  /dev/a",
        "      a camera",
        "  /dev/b",
        "      another; also usb-b",
        "      -> may not be opened",
    ]
    devices._show(Findings("v4l2", "camera.devices", (), title="cameras"))
    assert capsys.readouterr().out == "cameras: none\n"
