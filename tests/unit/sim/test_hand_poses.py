"""A hand between and at its stops, by closed form."""

import numpy as np
import pytest
from rig_sim.hand import Hand, Reach

from rig.profile.world import HandConfig

CONFIG = HandConfig(
    move_s=0.5, hold_s=1.5, nearest_mm=400.0, farthest_mm=900.0, tilt_deg=30.0, roll_deg=20.0
)
REACH = Reach(focal_px=600.0, half_size_px=(320.0, 200.0), half_board_mm=(100.0, 60.0))
HAND = Hand(CONFIG, REACH, seed=3)


def pose(t_s: float, hand: Hand = HAND) -> np.ndarray:
    return np.concatenate(hand.pose(t_s))


@pytest.mark.parametrize("number", [0, 1, 7])
@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.8, 1.0, 2.5])
def test_it_goes_smoothly_from_stop_to_stop_and_then_waits(number: int, share: float):
    before, after = pose(2.0 * number), pose(2.0 * number + 1.0)
    passed = min(share, 1.0)
    smooth = 3.0 * passed**2 - 2.0 * passed**3
    expected = before + smooth * (after - before)
    assert pose(2.0 * number + share * 0.5) == pytest.approx(expected, abs=2e-3)
    assert pose(2.0 * number + 1.999) == pytest.approx(after, abs=1e-9)
    assert pose(2.0 * number + 2.0) == pytest.approx(after, abs=1e-9)


def test_poses_lie_on_a_grid_of_half_a_micrometre_and_a_hundred_thousandth_of_a_degree():
    for t_s in (0.1, 0.2, 3.3):
        steps = pose(t_s) / np.repeat([0.0005, 0.00001], 3)
        assert steps == pytest.approx(np.rint(steps), abs=1e-4)
        assert np.any(np.rint(steps) % 2 == 1)


def test_stops_fill_what_may_be_reached_and_nothing_else():
    stops = np.array([pose(2.0 * number + 1.0) for number in range(600)])
    x_mm, y_mm, z_mm, turn_x_deg, turn_y_deg, roll_deg = stops.T
    # As many below the geometric mean of the distances as above, 600 mm, and the ends are near.
    assert z_mm.min() == pytest.approx(400.0, abs=4.0)
    assert z_mm.max() == pytest.approx(900.0, abs=8.0)
    assert np.mean(z_mm < 600.0) == pytest.approx(0.5, abs=0.06)
    tilt_deg = np.hypot(turn_x_deg, turn_y_deg)
    assert tilt_deg.max() == pytest.approx(30.0, abs=0.4)
    assert tilt_deg.mean() == pytest.approx(15.0, abs=1.0)
    assert np.mean(turn_y_deg > 0.0) == pytest.approx(0.5, abs=0.06)
    assert np.mean(turn_x_deg > 0.0) == pytest.approx(0.5, abs=0.06)
    assert (roll_deg.min(), roll_deg.max()) == pytest.approx((-20.0, 20.0), abs=0.5)
    # The edge of the board, were it square to the axis, stays within the picture and touches it.
    for place_mm, half_px, half_mm in ((x_mm, 320.0, 100.0), (y_mm, 200.0, 60.0)):
        room = (half_px * z_mm / 600.0 - half_mm) * (1.0 + 1e-5)
        assert np.all(np.abs(place_mm) <= room)
        assert np.max(place_mm / room) == pytest.approx(1.0, abs=0.02)
        assert np.min(place_mm / room) == pytest.approx(-1.0, abs=0.02)


def test_a_board_that_is_larger_than_the_picture_is_held_in_its_middle():
    narrow = Reach(focal_px=600.0, half_size_px=(320.0, 20.0), half_board_mm=(300.0, 60.0))
    for number in range(20):
        z_mm = pose(2.0 * number, Hand(CONFIG, narrow, seed=3))[2]
        x_mm, y_mm = pose(2.0 * number, Hand(CONFIG, narrow, seed=3))[:2]
        assert y_mm == 0.0
        assert (x_mm == 0.0) == (z_mm <= 300.0 * 600.0 / 320.0)
