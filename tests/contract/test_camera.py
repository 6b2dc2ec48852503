"""What every camera keeps, real, stored or simulated."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest
from rig_drivers.array.camera_array import CameraArray
from rig_drivers.stored.folder import FolderCamera
from rig_drivers.stored.recording import ReplayCamera
from rig_sim.faults import FaultyCamera, LateViews, LostViews, StuckCamera, UnpluggedCamera

from rig.devices import Camera, Clock, SystemClock
from rig.errors import CaptureTimeoutError, DeviceLostError, ViewSkewError
from rig.profile import FolderCameraConfig, RecordingCameraConfig, ViewConfig
from rig.recording import RecordingWriter
from tests.support.cameras import SMALL, SmallRig
from tests.support.video_arrays import VIDEO_PERIOD_S, video_array

VIEWS = ("centre", "left", "right", "top", "bottom")
PATIENCE_S = 10.0
"""Longest wait for a camera in real time, on a machine that is busy."""


@dataclass(frozen=True)
class Case:
    """One implementation, ready to be opened, and what it shares with the test."""

    camera: Camera
    clock: Clock
    stored: int | None
    """How many multi-views there are; None: no end."""


def make_sim(_: Path) -> Case:
    rig = SmallRig(SMALL)
    return Case(rig.camera(), rig.clock, None)


def make_healthy_wrapper(_: Path) -> Case:
    rig = SmallRig(SMALL)
    camera = FaultyCamera(
        rig.camera(), UnpluggedCamera(after=100), clock=rig.clock, max_skew_s=0.005, timeout_s=1.0
    )
    return Case(camera, rig.clock, None)


def make_folder(folder: Path) -> Case:
    random = np.random.default_rng(5)
    for number, view in itertools.product(range(4), VIEWS):
        image = random.integers(0, 256, (20, 30), np.uint8)
        cv2.imwrite(str(folder / f"{view}_{number}.png"), image)
    config = FolderCameraConfig(
        kind="folder", folder=str(folder), files={view: f"{view}_*.png" for view in VIEWS}
    )
    views = [ViewConfig(name=view, x_steps=i, y_steps=0.0) for i, view in enumerate(VIEWS)]
    clock = SystemClock()
    return Case(FolderCamera(config, views, root=folder, clock=clock), clock, 4)


def make_recording(folder: Path) -> Case:
    rig = SmallRig(SMALL)
    with rig.camera() as camera:
        file = folder / "four.mcap"
        with RecordingWriter(file, camera.views, camera.identity) as recording:
            for _ in range(4):
                recording.write(camera.grab(1.0))
    config = RecordingCameraConfig(kind="recording", file=str(file))
    clock = SystemClock()
    return Case(ReplayCamera(config, rig.profile.views, clock), clock, 4)


def make_oak(_: Path) -> Case:
    """The driver of OAK cameras over its pipeline, fed by simulated sensors."""
    if find_spec("depthai") is None:
        pytest.skip("depthai is not installed: pip install -e '.[oak]'")
    from tests.support.oak import OakRig, with_view

    rig = OakRig((*with_view("bottom"), "camera.rate_hz=25"))  # easy for a busy machine
    return Case(rig.camera(), rig.clock, None)


def make_v4l2_array(_: Path) -> Case:
    camera, _devices, clock = video_array(VIEWS)
    return Case(camera, clock, None)


def make_array_of_arrays(_: Path) -> Case:
    inner, _devices, clock = video_array(VIEWS[:2])
    other, *_rest = video_array(VIEWS[2:])
    outer = CameraArray(
        [other, inner], views=VIEWS, period_s=VIDEO_PERIOD_S, max_skew_s=0.005, timeout_s=2.0
    )
    return Case(outer, clock, None)


@pytest.fixture(
    params=[
        make_sim,
        make_healthy_wrapper,
        make_folder,
        make_recording,
        make_oak,
        make_v4l2_array,
        make_array_of_arrays,
    ]
)
def case(request: pytest.FixtureRequest, tmp_path: Path) -> Case:
    make: Callable[[Path], Case] = request.param
    return make(tmp_path)


def test_a_grab_has_every_view_in_the_promised_order(case: Case):
    with case.camera as camera:
        multi_view = camera.grab(PATIENCE_S)
        assert camera.views == VIEWS
        assert tuple(frame.view for frame in multi_view.frames) == VIEWS
        assert len({frame.image.shape for frame in multi_view.frames}) == 1
        assert all(frame.image.ndim == 2 for frame in multi_view.frames)


def test_pixels_are_read_only(case: Case):
    with case.camera as camera:
        for frame in camera.grab(PATIENCE_S).frames:
            with pytest.raises(ValueError, match="read-only"):
                frame.image[0, 0] = 1


def test_times_and_numbers_of_frames_grow(case: Case):
    with case.camera as camera:
        taken = [camera.grab(PATIENCE_S) for _ in range(3)]
    for before, after in itertools.pairwise(taken):
        for earlier, later in zip(before.frames, after.frames, strict=True):
            assert later.timestamp_s > earlier.timestamp_s
            assert later.sequence > earlier.sequence


def test_a_frame_is_not_older_than_the_grab_that_asked_for_it(case: Case):
    with case.camera as camera:
        for _ in range(3):
            case.clock.sleep_s(0.001)
            called_s = case.clock.now_s()
            multi_view = camera.grab(PATIENCE_S)
            assert all(frame.timestamp_s >= called_s for frame in multi_view.frames)
            assert case.clock.now_s() >= multi_view.timestamp_s


def test_views_of_one_grab_belong_to_one_instant(case: Case):
    with case.camera as camera:
        assert camera.grab(PATIENCE_S).skew_s <= 0.005


def test_a_closed_camera_gives_nothing(case: Case):
    with pytest.raises(DeviceLostError, match="not open"):
        case.camera.grab(PATIENCE_S)
    with case.camera as camera:
        camera.grab(PATIENCE_S)
    with pytest.raises(DeviceLostError, match="not open"):
        case.camera.grab(PATIENCE_S)
    with pytest.raises(DeviceLostError, match="not open"):
        next(case.camera.stream())


def test_it_can_be_opened_again(case: Case):
    with case.camera as camera:
        first = camera.grab(PATIENCE_S)
    with case.camera as camera:
        again = camera.grab(PATIENCE_S)
    for frame, before in zip(again.frames, first.frames, strict=True):
        # A free-running camera counts from its opening, and a grab waits for the next frame.
        assert frame.sequence <= before.sequence + (0 if case.stored is not None else 50)


def test_a_stream_yields_multi_views_one_after_the_other(case: Case):
    with case.camera as camera:
        taken = list(itertools.islice(camera.stream(), 4))
        assert len(taken) == 4
        times_s = [multi_view.timestamp_s for multi_view in taken]
        assert times_s == sorted(set(times_s))
        for before, after in itertools.pairwise(taken):
            for earlier, later in zip(before.frames, after.frames, strict=True):
                assert later.sequence == earlier.sequence + 1
        if case.stored is not None:
            assert next(camera.stream(), None) is None
        assert sum(camera.dropped.values()) == 0


def test_it_says_who_it_is(case: Case):
    assert set(case.camera.identity) >= {"kind", "model", "serial"}


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
