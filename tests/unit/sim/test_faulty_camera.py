"""Faults of a whole camera on a clock that only waiting moves."""

import itertools

import pytest
from rig_sim.faults import (
    CameraFault,
    FaultyCamera,
    LateViews,
    LostViews,
    StuckCamera,
    UnpluggedCamera,
)

from rig.errors import CaptureTimeoutError, DeviceLostError, ViewSkewError
from tests.support.cameras import SMALL, SmallRig


def faulty(fault: CameraFault, *, max_skew_s: float = 0.01) -> tuple[FaultyCamera, SmallRig]:
    rig = SmallRig(SMALL)
    camera = FaultyCamera(
        rig.camera(), fault, clock=rig.clock, max_skew_s=max_skew_s, timeout_s=0.5
    )
    return camera, rig


@pytest.mark.parametrize(
    ("fault", "error", "good"),
    [
        (LostViews(("left",)), CaptureTimeoutError, 0),
        (LostViews(("left",), 2), CaptureTimeoutError, 2),
        (LateViews(("left",), 0.02), ViewSkewError, 0),
        (LateViews(("left",), 0.02, 2), ViewSkewError, 2),
        (UnpluggedCamera(), DeviceLostError, 0),
        (UnpluggedCamera(3), DeviceLostError, 3),
    ],
)
def test_a_fault_strikes_after_so_many_good_multi_views_at_each_opening(
    fault: CameraFault, error: type[Exception], good: int
):
    camera, _ = faulty(fault)
    for _ in range(2):
        with camera:
            for _ in range(good):
                camera.grab(1.0)
            with pytest.raises(error):
                camera.grab(1.0)


def test_what_never_comes_is_waited_for_as_long_as_asked():
    camera, rig = faulty(LostViews(("left", "right")))
    with camera:
        began_s = rig.clock.now_s()
        with pytest.raises(CaptureTimeoutError) as caught:
            camera.grab(2.0)
        assert rig.clock.now_s() - began_s == pytest.approx(2.0, abs=1e-9)
    assert caught.value.missing == ("left", "right")


@pytest.mark.parametrize(("good", "numbers"), [(1, 1), (2, 2)])
def test_a_stuck_camera_gives_the_last_good_one_for_ever(good: int, numbers: int):
    camera, _ = faulty(StuckCamera(good))
    with camera:
        taken = [camera.grab(1.0) for _ in range(4)]
    stamps = [multiview.frames[0].timestamp_s for multiview in taken]
    assert len(set(stamps)) == numbers
    assert stamps == sorted(stamps)
    assert stamps[numbers - 1 :] == [stamps[-1]] * (5 - numbers)


def test_a_stuck_camera_is_good_once_if_nothing_else_is_said():
    assert StuckCamera() == StuckCamera(1)


def test_only_the_late_views_are_late():
    on_time, _ = faulty(LateViews(("left",), 0.004, 99))
    late, _ = faulty(LateViews(("left",), 0.004))
    with on_time, late:
        pairs = zip(on_time.grab(1.0).frames, late.grab(1.0).frames, strict=True)
        delays_s = {b.view: b.timestamp_s - a.timestamp_s for a, b in pairs}
    assert delays_s.pop("left") == pytest.approx(0.004)
    assert set(delays_s.values()) == {0.0}


def test_a_skew_as_large_as_allowed_is_let_pass():
    camera, _ = faulty(LateViews(("left",), 0.25), max_skew_s=0.25)
    with camera:
        skew_s = camera.grab(1.0).skew_s
    exact, _ = faulty(LateViews(("left",), 0.25), max_skew_s=skew_s)
    less, _ = faulty(LateViews(("left",), 0.25), max_skew_s=skew_s - 1e-9)
    with exact, less:
        assert exact.grab(1.0).skew_s == skew_s
        with pytest.raises(ViewSkewError):
            less.grab(1.0)


def test_a_stream_counts_what_is_out_of_step_and_gives_up_in_time():
    camera, rig = faulty(LateViews(("left",), 0.02, 3))
    with camera:
        stream = camera.stream()
        assert len(list(itertools.islice(stream, 3))) == 3
        assert camera.dropped["skew"] == 0
        began_s = rig.clock.now_s()
        with pytest.raises(CaptureTimeoutError):
            next(stream)
        passed_s = rig.clock.now_s() - began_s
        period_s = rig.config.frame_interval_s
        assert 0.5 < passed_s <= 0.5 + period_s + 1e-6
        assert camera.dropped["skew"] == pytest.approx(passed_s / period_s, abs=1.0)
    with camera:
        assert camera.dropped["skew"] == 0


def test_the_rest_is_told_by_the_good_camera():
    camera, rig = faulty(UnpluggedCamera())
    with camera:
        assert camera.views == tuple(view.name for view in rig.profile.views)
        assert camera.identity == rig.camera().identity
        assert "skew" in camera.dropped
