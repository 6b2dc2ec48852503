"""Every camera here keeps the suite of `rig.testing`; the simulated one also fails."""

import itertools
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest
from rig_drivers.array.camera_array import CameraArray
from rig_drivers.stored.folder import FolderCamera
from rig_drivers.stored.recording import ReplayCamera
from rig_drivers.v4l2.device_views import cameras_of
from rig_sim.faults import FaultyCamera, LateViews, LostViews, StuckCamera, UnpluggedCamera

from rig.devices import SystemClock
from rig.errors import CaptureTimeoutError, DeviceLostError, ViewSkewError
from rig.profile import FolderCameraConfig, RecordingCameraConfig, V4l2CameraConfig, ViewConfig
from rig.recording import RecordingWriter
from rig.testing import CameraCase
from rig.testing.test_camera import *  # noqa: F403 - the suite itself
from tests.support.cameras import SMALL, SmallRig
from tests.support.video_arrays import VIDEO_PERIOD_S, locked, video_array
from tests.support.video_kernel import FakeVideoKernel

VIEWS = ("centre", "left", "right", "top", "bottom")


def make_sim(_: Path) -> CameraCase:
    rig = SmallRig(SMALL)
    return CameraCase(rig.camera(), rig.clock, None)


def make_healthy_wrapper(_: Path) -> CameraCase:
    rig = SmallRig(SMALL)
    camera = FaultyCamera(
        rig.camera(), UnpluggedCamera(after=100), clock=rig.clock, max_skew_s=0.005, timeout_s=1.0
    )
    return CameraCase(camera, rig.clock, None)


def make_folder(folder: Path) -> CameraCase:
    random = np.random.default_rng(5)
    for number, view in itertools.product(range(4), VIEWS):
        image = random.integers(0, 256, (20, 30), np.uint8)
        cv2.imwrite(str(folder / f"{view}_{number}.png"), image)
    config = FolderCameraConfig(
        kind="folder", folder=str(folder), files={view: f"{view}_*.png" for view in VIEWS}
    )
    views = [ViewConfig(name=view, x_steps=i, y_steps=0.0) for i, view in enumerate(VIEWS)]
    clock = SystemClock()
    return CameraCase(FolderCamera(config, views, root=folder, clock=clock), clock, 4)


def make_recording(folder: Path) -> CameraCase:
    rig = SmallRig(SMALL)
    with rig.camera() as camera:
        file = folder / "four.mcap"
        with RecordingWriter(file, camera.views, camera.identity) as recording:
            for _ in range(4):
                recording.write(camera.grab(1.0), time_ns=0)
    config = RecordingCameraConfig(kind="recording", file=str(file))
    clock = SystemClock()
    return CameraCase(ReplayCamera(config, rig.profile.views, clock), clock, 4)


def make_oak(_: Path) -> CameraCase:
    """The driver of OAK cameras over its pipeline, fed by simulated sensors."""
    if find_spec("depthai") is None:
        pytest.skip("depthai is not installed: pip install -e '.[oak]'")
    from tests.support.oak import OakRig, with_view

    rig = OakRig((*with_view("bottom"), "camera.rate_hz=25"))  # easy for a busy machine
    return CameraCase(rig.camera(), rig.clock, None)


def make_v4l2_array(_: Path) -> CameraCase:
    camera, _devices, clock = video_array(VIEWS)
    return CameraCase(camera, clock, None)


def make_split_picture(_: Path) -> CameraCase:
    """Two views in the picture of one device, and one of another device beside them."""
    clock = SystemClock()
    kernel = FakeVideoKernel({"/dev/array": locked(0), "/dev/alone": locked(1)}, clock)
    devices = dict.fromkeys(VIEWS[:2], "/dev/array") | dict.fromkeys(VIEWS[2:3], "/dev/alone")
    parts = {VIEWS[0]: "side-by-side:1", VIEWS[1]: "side-by-side:2", VIEWS[2]: {"width_px": 16}}
    config = V4l2CameraConfig.model_validate(
        {
            **{"kind": "v4l2", "width_px": 32, "height_px": 24, "rate_hz": 25},
            **{"pixel_format": "GREY", "devices": devices, "parts": parts},
        }
    )
    array = CameraArray(
        cameras_of(config, kernel, clock),
        views=VIEWS[:3],
        period_s=VIDEO_PERIOD_S,
        max_skew_s=0.005,
        timeout_s=2.0,
    )
    return CameraCase(array, clock, None)


def make_folder_of_pairs(folder: Path) -> CameraCase:
    for number in range(4):
        cv2.imwrite(str(folder / f"{number}.png"), np.full((20, 64), number, np.uint8))
    parts = {"left": "side-by-side:1", "right": "side-by-side:2"}
    config = FolderCameraConfig.model_validate(
        {
            **{"kind": "folder", "folder": str(folder), "parts": parts},
            "files": dict.fromkeys(parts, "*.png"),
        }
    )
    views = [ViewConfig(name=view, x_steps=i, y_steps=0.0) for i, view in enumerate(parts)]
    clock = SystemClock()
    return CameraCase(FolderCamera(config, views, root=folder, clock=clock), clock, 4)


def make_folder_in_colour(folder: Path) -> CameraCase:
    """Colour pictures of one view beside smaller grey ones of another."""
    random = np.random.default_rng(6)
    for number in range(4):
        bright = random.integers(0, 256, (24, 32, 3), np.uint8)
        cv2.imwrite(str(folder / f"left_{number}.png"), bright)
        cv2.imwrite(str(folder / f"right_{number}.png"), bright[:20, :30, 0])
    names = ("left", "right")
    config = FolderCameraConfig(
        kind="folder", folder=str(folder), files={name: f"{name}_*.png" for name in names}
    )
    views = [ViewConfig(name=view, x_steps=i, y_steps=0.0) for i, view in enumerate(names)]
    clock = SystemClock()
    return CameraCase(FolderCamera(config, views, root=folder, clock=clock), clock, 4)


def make_array_of_arrays(_: Path) -> CameraCase:
    inner, _devices, clock = video_array(VIEWS[:2])
    other, *_rest = video_array(VIEWS[2:])
    outer = CameraArray(
        [other, inner], views=VIEWS, period_s=VIDEO_PERIOD_S, max_skew_s=0.005, timeout_s=2.0
    )
    return CameraCase(outer, clock, None)


@pytest.fixture(
    params=[
        make_sim,
        make_healthy_wrapper,
        make_folder,
        make_recording,
        make_oak,
        make_v4l2_array,
        make_array_of_arrays,
        make_split_picture,
        make_folder_of_pairs,
        make_folder_in_colour,
    ]
)
def camera_case(request: pytest.FixtureRequest, tmp_path: Path) -> CameraCase:
    make: Callable[[Path], CameraCase] = request.param
    return make(tmp_path)


def opened(fault: LostViews | LateViews | StuckCamera | UnpluggedCamera):
    rig = SmallRig(SMALL)
    camera = FaultyCamera(rig.camera(), fault, clock=rig.clock, max_skew_s=0.005, timeout_s=1.0)
    return rig, camera


def test_views_that_never_come_end_in_a_timeout_that_names_them():
    rig, camera = opened(LostViews(("left", "top"), after=1))
    with camera:
        camera.grab(0.5)
        began_s = rig.clock.now_s()
        with pytest.raises(CaptureTimeoutError, match=r"left, top") as caught:
            camera.grab(0.5)
        assert caught.value.missing == ("left", "top")
        assert rig.clock.now_s() - began_s == pytest.approx(0.5)


def test_a_wait_shorter_than_an_exposure_ends_in_a_timeout():
    rig = SmallRig(SMALL)
    with rig.camera() as camera, pytest.raises(CaptureTimeoutError):
        camera.grab(rig.config.exposure_s / 2.0)
    assert rig.clock.now_s() == pytest.approx(rig.config.exposure_s / 2.0)


def test_views_too_far_apart_are_refused_in_a_grab_and_dropped_from_a_stream():
    _, camera = opened(LateViews(("right",), late_s=0.02, after=1))
    with camera:
        camera.grab(1.0)
        with pytest.raises(ViewSkewError, match=r"20\.00 ms apart, allowed 5\.00 ms"):
            camera.grab(1.0)
        with pytest.raises(CaptureTimeoutError):
            next(camera.stream())
        assert camera.dropped["skew"] > 0


def test_a_stuck_camera_repeats_an_old_frame():
    rig, camera = opened(StuckCamera(after=1))
    with camera:
        good = camera.grab(1.0)
        called_s = rig.clock.now_s()
        assert camera.grab(1.0) is good
        assert good.timestamp_s < called_s


def test_an_unplugged_camera_must_be_opened_again():
    _, camera = opened(UnpluggedCamera(after=1))
    with camera:
        camera.grab(1.0)
        with pytest.raises(DeviceLostError, match="open again"):
            camera.grab(1.0)
    with camera:
        assert len(camera.grab(1.0).frames) == len(VIEWS)


def test_a_grab_after_a_move_shows_the_board_where_it_is_now():
    rig = SmallRig(SMALL)
    with rig.camera() as camera:
        before = camera.grab(1.0).frames[0].image.astype(int)
        rig.slide.at_mm = -300.0
        moved = camera.grab(1.0).frames[0].image.astype(int)
        rig.slide.at_mm = -603.0
        back = camera.grab(1.0).frames[0].image.astype(int)
    noise = np.abs(back - before).mean()
    assert np.abs(moved - before).mean() > 5.0 * noise
