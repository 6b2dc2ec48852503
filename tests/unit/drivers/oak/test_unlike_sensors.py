"""Three cameras of an OAK-D that differ, through the real pipeline without a device."""

import itertools
from collections.abc import Mapping
from datetime import timedelta
from pathlib import Path

import cv2
import numpy as np
import pytest
from pydantic import ValidationError
from rig_drivers.oak.camera import OakCamera
from rig_drivers.oak.decode import decode
from rig_drivers.oak.host_sensors import HostSensors, _message
from rig_drivers.oak.sdk import dai
from rig_sim.oak import SensorFaults, SimOakRack, SimSensorFrame

import rig
from rig.database import open_store
from rig.errors import ControlError, DeviceLostError
from tests.support.oak import OakRig, oak_config, three_views
from tests.support.stores import sqlite_url

COLOUR = (
    "camera.sensors.left.width_px=192",
    "camera.sensors.left.height_px=108",
    'camera.sensors.left.pixels="nv12"',
    "camera.sensors.left.exposure_s=0.004",
    "camera.sensors.left.iso=200",
    "camera.sensors.left.lens_position=130",
    "camera.sensors.left.white_balance_k=5000",
    "camera.max_skew_s=0.004",
)


def test_every_view_has_its_own_size_exposure_and_colour():
    with OakRig(COLOUR).camera() as camera:
        multiview = camera.grab(10.0)
    by_view = {frame.view: frame for frame in multiview.frames}
    left, right = by_view["left"], by_view["right"]
    assert left.image.shape == (108, 192)
    assert right.image.shape == (100, 160)
    assert (left.exposure_s, right.exposure_s) == (0.004, 0.008)
    assert right.colour is None
    assert left.colour is not None
    assert left.colour.shape == (108, 192, 3)
    # The light of a warm lamp: red over green over blue wherever there is light.
    bright = left.image > 120
    red, green, blue = (float(left.colour[bright][:, c].mean()) for c in range(3))
    assert red > 1.1 * green > 1.2 * blue


def test_a_control_of_one_sensor_is_compared_with_its_own():
    faults = {"left": SensorFaults(iso=100)}
    rig_of_four = OakRig((*COLOUR, "camera.timeout_s=0.1"), faults)
    with pytest.raises(ControlError, match="view left: asked for iso 200, the camera applies 100"):
        rig_of_four.camera().__enter__()


@pytest.mark.slow
def test_a_slow_link_is_noticed_by_what_comes_through_the_pipeline(
    caplog: pytest.LogCaptureFixture,
):
    faults = {view: SensorFaults(drop_share=0.6) for view in ("centre", "left", "right", "top")}
    slow = OakRig(("camera.rate_hz=100", "camera.timeout_s=60"), faults)
    told = {**slow.sensors().identity, "link": "gigabit Ethernet"}
    names = [view.name for view in slow.profile.views]

    class Linked(HostSensors):
        @property
        def identity(self) -> Mapping[str, str]:
            return told

    linked = Linked(SimOakRack(slow.config, slow.world, faults))
    with OakCamera(slow.config, names, linked, slow.clock) as camera:
        for _ in itertools.islice(camera.stream(), 4):
            pass
    assert "multi-views arrive whole over gigabit Ethernet" in caplog.text
    assert "as over Ethernet of 100 Mbit/s" in caplog.text


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"top": {"iso": 200}}, "sensors names no view: top; there are left, right"),
        ({"left": {"exposure_s": 0.1}}, r"sensors\.left\.exposure_s = 0\.1 is no shorter than"),
        ({"left": {"width_px": 8}}, "greater than or equal to 16"),
        ({"left": {"rate_hz": 8}}, "Extra inputs are not permitted"),
    ],
)
def test_a_sensor_that_makes_no_sense_is_told(changes: dict[str, object], says: str):
    with pytest.raises(ValidationError, match=says):
        oak_config(sensors=changes)


def test_what_a_sensor_does_not_say_is_as_for_all():
    config = three_views(rate_hz=12.0)
    assert config.of("left") is config
    middle = config.of("middle")
    assert (middle.size_px, middle.iso, middle.rate_hz) == ((1920, 1080), 200, 12.0)
    assert config.size_of("middle") == (1920, 1080)
    assert config.size_of("right") == config.size_px == (1280, 800)


def nv12(stride: int = 20, *, rows: int = 8, columns: int = 16) -> tuple[dai.ImgFrame, np.ndarray]:
    """A frame with padded lines, and the picture that OpenCV makes of it."""
    random = np.random.default_rng(4)
    planes = random.integers(40, 200, (rows + rows // 2, columns), dtype=np.uint8)
    frame = dai.ImgFrame()
    frame.setType(dai.ImgFrame.Type.NV12)
    frame.setSize(columns, rows)
    frame.setStride(stride)
    frame.setData(np.pad(planes, ((0, 0), (0, stride - columns))).tobytes())
    frame.setTimestamp(timedelta(seconds=5.0))
    return frame, planes


@pytest.mark.parametrize("stride", [16, 20])
def test_nv12_is_luma_and_the_colour_behind_it(stride: int):
    frame, planes = nv12(stride)
    found = decode(frame, "camera")
    assert np.array_equal(found.image, planes[:8])
    assert found.colour is not None
    assert np.array_equal(found.colour, cv2.cvtColor(planes, cv2.COLOR_YUV2RGB_NV12))


def test_half_an_nv12_frame_is_damaged():
    frame, planes = nv12(16)
    frame.setData(planes[:10].tobytes())
    with pytest.raises(DeviceLostError, match="sent a damaged frame"):
        decode(frame, "camera")


def test_a_source_in_colour_is_sent_as_a_device_would():
    colour = np.full((6, 8, 3), (180, 120, 60), np.uint8)
    grey = np.full((6, 8), 124, np.uint8)
    sent = SimSensorFrame(grey, 5.0, 1, 0.001, 100, -1, 0, None, colour)
    found = decode(_message(sent), "camera")
    assert np.array_equal(found.image, grey)
    assert found.colour is not None
    # Luma of BT.601: 16 + 0.257 R + 0.504 G + 0.098 B = 128.6 for this colour, 124 is 4.6 below.
    assert np.abs(found.colour.astype(int) - (180 - 5, 120 - 5, 60 - 5)).max() <= 3


COARSE = (
    "world.renderer=analytic",
    "world.capture_scene=board",
    "camera.width_px=320",
    "camera.height_px=200",
    "world.optics.focal_px=225.0",
    "camera.sensors.colour.width_px=480",
    "camera.sensors.colour.height_px=270",
    "world.view_errors.colour.focal_px=380.0",
    "slopes.range_mm=[700.0, 1100.0]",
    "quality.depth_sigma_pct=5.0",
    "quality.valid_share_pct=0.0",
    "camera.timeout_s=20.0",
)


@pytest.mark.slow
def test_three_unlike_cameras_give_depth_of_the_colour_picture_by_their_own_calibration(
    tmp_path: Path,
):
    url = sqlite_url(tmp_path)
    open_store(url).close()
    with rig.open("sim-oak-d", database=url, overrides=COARSE) as camera:
        frame = camera.grab(20.0)
        assert camera.run.curve is not None
        assert camera.run.curve.source == "factory"
    assert [one.image.shape for one in frame.views.frames] == [(270, 480), (200, 320), (200, 320)]
    assert frame.colour is not None
    assert frame.colour.shape == (270, 480, 3)
    assert frame.depth_mm.shape == frame.image.shape == (270, 480)
    board = frame.depth_mm[115:155, 200:280]  # of 853 mm, see `test_factory`
    known = np.isfinite(board)
    assert known.mean() > 0.9
    assert np.median(board[known]) == pytest.approx(853.0, rel=0.005)
    assert np.mean(np.abs(board[known] - 853.0) < 20.0) > 0.9
