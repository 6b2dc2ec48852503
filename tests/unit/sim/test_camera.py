"""The simulated camera beyond what every camera keeps."""

import itertools

import numpy as np
import pytest

from tests.support.cameras import SMALL, SmallRig

INTERVAL_S, EXPOSURE_S = 0.05, 0.01
TIMED = (
    *SMALL,
    f"camera.frame_interval_s={INTERVAL_S}",
    f"camera.exposure_s={EXPOSURE_S}",
)


def test_a_grab_waits_for_the_next_frame():
    rig = SmallRig(TIMED)
    with rig.camera() as camera:
        rig.clock.sleep_s(0.012)
        taken = camera.grab(1.0)
    assert taken.timestamp_s == pytest.approx(INTERVAL_S + EXPOSURE_S / 2.0)
    assert rig.clock.now_s() == pytest.approx(INTERVAL_S + EXPOSURE_S)


def test_the_board_is_seen_where_it_is_in_the_middle_of_the_exposure():
    asked_s: list[float] = []

    class Watched:
        def travelled_mm(self, t_s: float) -> float:
            asked_s.append(t_s)
            return -603.0

    rig = SmallRig(TIMED, slide=Watched())  # pyright: ignore[reportArgumentType]
    with rig.camera() as camera:
        taken = camera.grab(1.0)
    assert asked_s == [taken.timestamp_s]


def test_a_slow_consumer_of_the_stream_gets_the_newest_frame_and_the_lost_ones_are_counted():
    rig = SmallRig(TIMED)
    with rig.camera() as camera:
        stream = camera.stream()
        first = next(stream)
        rig.clock.sleep_s(3.5 * INTERVAL_S)
        second = next(stream)
        assert camera.dropped == {"late": 2}
        assert second.frames[0].sequence == first.frames[0].sequence + 3
        assert second.timestamp_s == pytest.approx(first.timestamp_s + 3.0 * INTERVAL_S)


def test_two_runs_with_one_seed_see_the_same_pixels():
    def take(seed: int) -> np.ndarray:
        with SmallRig((*SMALL, f"world.seed={seed}")).camera() as camera:
            return np.stack([camera.grab(1.0).images for _ in range(2)])

    np.testing.assert_array_equal(take(3), take(3))
    assert (take(3) != take(4)).any()


def test_every_view_and_every_frame_has_its_own_noise():
    rig = SmallRig((*SMALL, "world.view_errors={}"))
    with rig.camera() as camera:
        stacks = [
            np.stack(taken.images).astype(int) for taken in itertools.islice(camera.stream(), 2)
        ]
    wall = (slice(0, 20), slice(0, 160))
    between_frames = stacks[0][0][wall] - stacks[1][0][wall]
    between_views = stacks[0][0][wall] - stacks[0][3][wall]
    assert between_frames.std() > 1.5
    assert between_views.std() > 1.5


def test_it_reports_the_temperature_of_the_world():
    rig = SmallRig((*SMALL, "world.temperature.rise_degc=10.0", "world.temperature.time_s=1.0"))
    with rig.camera() as camera:
        rig.clock.sleep_s(5.0)
        taken = camera.grab(1.0)
    assert taken.temperature_degc == pytest.approx(35.0, abs=0.1)
