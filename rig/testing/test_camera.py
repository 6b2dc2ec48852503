"""What every camera keeps, real, stored or simulated; `camera_case` is the package's fixture."""

import itertools

import pytest

from rig.errors import DeviceLostError
from rig.testing.cases import CameraCase


def test_a_grab_has_every_view_in_the_promised_order(camera_case: CameraCase) -> None:
    with camera_case.camera as camera:
        multiview = camera.grab(camera_case.patience_s)
        assert tuple(frame.view for frame in multiview.frames) == camera.views
        assert len(set(camera.views)) == len(camera.views) >= 2
        assert all(frame.image.ndim == 2 for frame in multiview.frames)
        for frame in multiview.frames:
            if frame.colour is not None:
                assert frame.colour.shape == (*frame.image.shape, 3)
                assert frame.colour.dtype == "uint8"


def test_pixels_are_read_only(camera_case: CameraCase) -> None:
    with camera_case.camera as camera:
        for frame in camera.grab(camera_case.patience_s).frames:
            with pytest.raises(ValueError, match="read-only"):
                frame.image[0, 0] = 1
            if frame.colour is not None:
                with pytest.raises(ValueError, match="read-only"):
                    frame.colour[0, 0] = 1


def test_times_and_numbers_of_frames_grow(camera_case: CameraCase) -> None:
    with camera_case.camera as camera:
        taken = [camera.grab(camera_case.patience_s) for _ in range(3)]
    for before, after in itertools.pairwise(taken):
        for earlier, later in zip(before.frames, after.frames, strict=True):
            assert later.timestamp_s > earlier.timestamp_s
            assert later.sequence > earlier.sequence


def test_a_frame_is_not_older_than_the_grab_that_asked_for_it(camera_case: CameraCase) -> None:
    with camera_case.camera as camera:
        for _ in range(3):
            camera_case.clock.sleep_s(0.001)
            called_s = camera_case.clock.now_s()
            multiview = camera.grab(camera_case.patience_s)
            assert all(frame.timestamp_s >= called_s for frame in multiview.frames)
            assert camera_case.clock.now_s() >= multiview.timestamp_s


def test_views_of_one_grab_belong_to_one_instant(camera_case: CameraCase) -> None:
    with camera_case.camera as camera:
        assert camera.grab(camera_case.patience_s).skew_s <= 0.005


def test_a_closed_camera_gives_nothing(camera_case: CameraCase) -> None:
    with pytest.raises(DeviceLostError, match="not open"):
        camera_case.camera.grab(camera_case.patience_s)
    with camera_case.camera as camera:
        camera.grab(camera_case.patience_s)
    with pytest.raises(DeviceLostError, match="not open"):
        camera_case.camera.grab(camera_case.patience_s)
    with pytest.raises(DeviceLostError, match="not open"):
        next(camera_case.camera.stream())


def test_it_can_be_opened_again(camera_case: CameraCase) -> None:
    with camera_case.camera as camera:
        first = camera.grab(camera_case.patience_s)
    with camera_case.camera as camera:
        again = camera.grab(camera_case.patience_s)
    for frame, before in zip(again.frames, first.frames, strict=True):
        # A free-running camera counts from its opening, and a grab waits for the next frame.
        assert frame.sequence <= before.sequence + (0 if camera_case.stored is not None else 50)


def test_a_stream_yields_multiviews_one_after_the_other(camera_case: CameraCase) -> None:
    with camera_case.camera as camera:
        taken = list(itertools.islice(camera.stream(), 4))
        assert len(taken) == 4
        times_s = [multiview.timestamp_s for multiview in taken]
        assert times_s == sorted(set(times_s))
        for before, after in itertools.pairwise(taken):
            for earlier, later in zip(before.frames, after.frames, strict=True):
                assert later.sequence > earlier.sequence
                assert camera_case.may_drop or later.sequence == earlier.sequence + 1
        if camera_case.stored is not None:
            assert next(camera.stream(), None) is None
        assert camera_case.may_drop or sum(camera.dropped.values()) == 0


def test_it_says_who_it_is(camera_case: CameraCase) -> None:
    assert set(camera_case.camera.identity) >= {"kind", "model", "serial"}
