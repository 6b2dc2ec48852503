"""The contract of a camera that gives depth: newest or once, one thread, errors of rig's own."""

import itertools
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from rig_sim.faults import FaultyCamera, LateViews, LostViews, UnpluggedCamera
from rig_sim.world import World

import rig
from rig.devices import Camera
from rig.errors import (
    CameraUseError,
    CaptureTimeoutError,
    CurveError,
    DeviceLostError,
    DeviceNotFoundError,
    ViewSkewError,
)
from rig.live.camera import DepthCamera
from tests.unit.live.devices import Gated, Wrap, tiny_rig

INTERVAL_S = 1.0 / 30.0


def faulty(fault: LateViews | LostViews | UnpluggedCamera, *, max_skew_s: float = 0.005) -> Wrap:
    return lambda camera, world: FaultyCamera(
        camera, fault, clock=world.clock, max_skew_s=max_skew_s, timeout_s=3.0
    )


def test_a_slow_program_sees_the_newest_frame_and_the_driver_does_not_wait():
    camera, world = tiny_rig()
    with camera:
        numbers: list[int] = []
        for frame in itertools.islice(camera, 4):
            numbers.append(frame.views.frames[0].sequence)
            age_s = world.clock.now_s() - frame.views.timestamp_s
            assert age_s <= INTERVAL_S + 0.008
            world.clock.sleep_s(10.5 * INTERVAL_S)
        assert numbers == [0, 10, 21, 31]
        assert camera.dropped["late"] == 28


def test_waiting_for_the_camera_ends_where_measuring_begins():
    camera, _ = tiny_rig()
    begun_s = time.perf_counter()
    with camera:
        frames = list(itertools.islice(camera, 3))
    took_s = time.perf_counter() - begun_s
    measuring_s = sum(frame.measuring_s for frame in frames)
    assert 0.0 < camera.waited_s <= took_s - measuring_s
    # In simulated time nothing waits: 4 ms are from mid-exposure to the end of the exposure.
    for frame in frames:
        assert frame.measuring_s <= frame.latency_s - 0.004 < frame.measuring_s + 1.0


def test_a_grab_is_exposed_after_the_call_also_within_a_loop():
    camera, world = tiny_rig()
    with camera:
        for frame in itertools.islice(camera, 2):
            called_s = world.clock.now_s()
            grabbed = camera.grab()
            assert min(f.began_s for f in grabbed.views.frames) >= called_s
            assert grabbed.index == frame.index + 1


def stored_rig(folder: Path, count: int) -> DepthCamera:
    """The simulated rig, its camera a folder of so many multi-views."""
    random = np.random.default_rng(1)
    names = ("centre", "left", "right", "top", "bottom")
    for number in range(count):
        picture = random.integers(0, 255, (40, 64), dtype=np.uint8)
        for name in names:
            cv2.imwrite(str(folder / f"{name}_{number}.png"), picture)
    files = ", ".join(f'{name} = "{name}_*.png"' for name in names)
    return rig.open(
        rig_profile(),
        curve=rig.load_curve(rig_profile().with_name("simulated_rig_curve.json")),
        calibration="none",
        overrides=[
            "camera.kind=folder",
            f"camera.folder={folder}",
            f"camera.files={{{files}}}",
            "camera.reconnect_s=5.0",
            "slopes.range_px=[-2.0, 3.0]",
        ],
    )


def rig_profile() -> Path:
    return Path(rig.__file__).parent / "testing" / "simulated_rig.toml"


def test_stored_pictures_come_once_each_and_then_the_loop_ends(tmp_path: Path):
    with stored_rig(tmp_path, 3) as camera:
        first = next(iter(camera))
        others = list(camera)
        assert [frame.index for frame in (first, *others)] == [0, 1, 2]
        pictures = [frame.views.frames[0].image for frame in (first, *others)]
        assert len({picture.tobytes() for picture in pictures}) == 3
        with pytest.raises(DeviceLostError, match="holds 3"):
            camera.grab()
        assert list(camera) == []


def test_a_damaged_picture_ends_the_loop_and_is_not_waited_for(tmp_path: Path):
    with stored_rig(tmp_path, 3) as camera:
        (tmp_path / "left_1.png").write_bytes(b"no picture")
        frames = iter(camera)
        next(frames)
        with pytest.raises(DeviceLostError, match=r"left_1\.png") as caught:
            next(frames)
        assert "looked for" not in str(caught.value)


def test_outside_of_with_it_is_refused():
    camera, _ = tiny_rig()
    for use in (camera.grab, lambda: iter(camera), lambda: camera.identity):
        with pytest.raises(CameraUseError, match=r"is not open; use .with rig\.open"):
            use()
    with camera:
        left = iter(camera)
        next(left)
        with pytest.raises(CameraUseError, match="it is open already"):
            camera.__enter__()
        camera.grab()
    assert list(left) == []
    for use in (camera.grab, lambda: iter(camera), camera.__enter__):
        with pytest.raises(CameraUseError, match="was closed"):
            use()
    camera.close()


def test_closed_before_it_was_opened_it_stays_closed():
    camera, _ = tiny_rig()
    camera.close()
    with pytest.raises(CameraUseError, match="was closed"):
        camera.__enter__()


def in_thread(work: Callable[[], object]) -> tuple[threading.Thread, list[BaseException]]:
    errors: list[BaseException] = []

    def run() -> None:
        try:
            work()
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread, errors


def gated_rig() -> tuple[DepthCamera, Gated]:
    made: list[Gated] = []

    def wrap(camera: Camera, _: World) -> Gated:
        made.append(Gated(camera))
        return made[0]

    camera, _ = tiny_rig(wrap)
    return camera, made[0]


def test_closing_from_another_thread_ends_the_loop_and_a_second_thread_is_refused():
    camera, gated = gated_rig()
    seen: list[int] = []

    def loop() -> None:
        seen.extend(frame.index for frame in camera)

    with camera:
        looping, errors = in_thread(loop)
        assert gated.is_waiting.wait(60.0)
        for use in (camera.grab, lambda: next(iter(camera)), camera.__enter__):
            with pytest.raises(CameraUseError, match="another thread uses it"):
                use()
        closing, more = in_thread(camera.close)
        gated.gate.set()
        for thread in (closing, looping):
            thread.join(60.0)
            assert not thread.is_alive()
        assert errors == more == []
        assert seen[0] == 0
        assert gated.closed == 1  # by the other thread, not by the end of this block
    assert gated.closed == 1


def test_while_one_thread_loops_another_gets_no_frames_between_its_frames():
    camera, _ = tiny_rig()
    with camera:
        loop = iter(camera)
        next(loop)
        for use in (camera.grab, lambda: list(camera)):
            thread, errors = in_thread(lambda use=use: use())
            thread.join(60.0)
            (error,) = errors
            assert isinstance(error, CameraUseError)
        next(loop)
        del loop
        thread, errors = in_thread(camera.grab)
        thread.join(60.0)
        assert errors == []


def test_closing_in_the_middle_of_a_frame_as_a_signal_would_ends_after_it():
    closers: list[Callable[[], None]] = []

    class Signalled(Gated):
        def stream(self) -> Iterator[rig.MultiView]:
            for count, multiview in enumerate(self._camera.stream()):
                if count == 2:
                    closers[0]()
                yield multiview

    camera, _ = tiny_rig(lambda device, _: Signalled(device))
    closers.append(camera.close)
    with camera:
        assert [frame.index for frame in camera] == [0, 1, 2]
        with pytest.raises(CameraUseError, match="was closed"):
            camera.grab()


def test_a_loop_that_was_interrupted_can_be_begun_again():
    class Interrupted(Gated):
        def stream(self) -> Iterator[rig.MultiView]:
            for multiview in self._camera.stream():
                if not self.gate.is_set():
                    self.gate.set()
                    raise KeyboardInterrupt  # as Jupyter's stop button does
                yield multiview

    camera, _ = tiny_rig(lambda device, _: Interrupted(device))
    with camera:
        with pytest.raises(KeyboardInterrupt):
            list(camera)
        assert [frame.index for frame in itertools.islice(camera, 2)] == [0, 1]


def test_an_unplugged_camera_ends_the_loop_with_an_error():
    camera, world = tiny_rig(faulty(UnpluggedCamera(after=2)))
    seen: list[int] = []
    with camera, pytest.raises(DeviceLostError, match="stopped answering; check cable") as caught:
        seen.extend(frame.index for frame in camera)
    assert "looked for" not in str(caught.value)
    assert world.clock.now_s() < 1.0


def test_a_silent_view_ends_the_loop_with_an_error():
    camera, _ = tiny_rig(faulty(LostViews(("top",), after=1)))
    with camera, pytest.raises(CaptureTimeoutError, match="nothing came from top"):
        list(camera)


def test_a_camera_that_comes_back_goes_on():
    camera, _ = tiny_rig(faulty(UnpluggedCamera(after=2)), "camera.reconnect_s=5.0")
    with camera:
        frames = list(itertools.islice(camera, 5))
        assert [frame.index for frame in frames] == list(range(5))
        assert camera.dropped["reconnect"] == 2
        with pytest.raises(DeviceLostError):  # a grab never goes on across a loss
            [camera.grab() for _ in range(3)]


class Gone(FaultyCamera):
    """A camera that can be opened once only."""

    openings = 0

    def __enter__(self) -> "Gone":
        self.openings += 1
        if self.openings > 1:
            raise DeviceNotFoundError("camera sim", "is not there", advice="plug it in")
        super().__enter__()
        return self


def test_a_camera_that_stays_away_ends_the_loop_with_what_was_tried():
    camera, world = tiny_rig(
        lambda device, world: Gone(
            device, UnpluggedCamera(after=1), clock=world.clock, max_skew_s=0.005, timeout_s=3.0
        ),
        "camera.reconnect_s=4.0",
    )
    with camera, pytest.raises(DeviceLostError, match="looked for it for 4 s, it did not come"):
        list(camera)
    assert 4.0 <= world.clock.now_s() < 5.0


def test_skewed_views_are_dropped_in_a_loop_and_an_error_of_a_grab():
    camera, _ = tiny_rig(faulty(LateViews(("top",), late_s=0.02), max_skew_s=1.0))
    with camera, pytest.raises(ViewSkewError, match=r"20\.00 ms apart, allowed 5\.00 ms"):
        camera.grab()
    camera, _ = tiny_rig(faulty(LateViews(("top",), late_s=0.02, after=2), max_skew_s=1.0))
    with camera:
        frames = iter(camera)
        next(frames)
        next(frames)
        assert camera.dropped["skew"] == 0


def test_the_time_of_a_frame_is_that_of_mid_exposure_by_the_wall_clock():
    camera, world = tiny_rig(utc_ns=lambda: 10**18)
    with camera:
        for frame in itertools.islice(camera, 3):
            # Handed over when the exposure of 8 ms has ended.
            assert frame.time_ns == pytest.approx(10**18 - 4_000_000, abs=2_000)
            world.clock.sleep_s(1.0)


def test_slopes_only_have_no_depth_and_say_so(tmp_path: Path):
    with rig.open(rig_profile(), curve="none", calibration="none") as camera:
        frame = camera.grab()
    assert frame.depth is None
    assert (frame.label == frame.slopes.label).all()
    for use in (lambda: frame.depth_mm, lambda: frame.sigma_mm):
        with pytest.raises(CurveError, match="slopes only; open it without"):
            use()
    with pytest.raises(rig.errors.CalibrationError, match="run `rig calibrate simulated-rig`"):
        frame.points_mm()


def test_a_rig_without_a_curve_is_refused_before_its_device_is_opened(tmp_path: Path):
    with pytest.raises(rig.errors.StoreError, match="there is none"):
        rig.open(rig_profile(), database=f"sqlite:///{tmp_path}/none.sqlite")
