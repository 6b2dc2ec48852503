import numpy as np

from rig.epipolar.occlusion import hidden_points


def test_the_band_beside_a_near_square_is_hidden() -> None:
    slope = np.zeros((40, 60), np.float32)
    slope[10:30, 20:40] = 5.0
    _, hidden = hidden_points(slope, np.array([-1.0, 0.0, 1.0]), np.zeros(3), 0.5, 2)
    assert hidden[20, 15:20].all()
    assert hidden[20, 40:45].all()
    assert not hidden[20, :14].any()
    assert not hidden[20, 46:].any()
    assert not hidden[20, 20:40].any()
    assert not hidden[5].any()


def test_each_view_hides_its_own_side_and_a_margin() -> None:
    slope = np.zeros((40, 60), np.float32)
    slope[10:30, 20:40] = 5.0
    x_steps, y_steps = np.array([-1.0, 0.0, 1.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])
    exact, _ = hidden_points(slope, x_steps, y_steps, 0.5, 0)
    wide, _ = hidden_points(slope, x_steps, y_steps, 0.5, 2)
    # The square moves right in the first view, left in the third and up in the last.
    assert np.flatnonzero(exact[0, 20]).tolist() == [40, 41, 42, 43, 44]
    assert np.flatnonzero(wide[0, 20]).tolist() == [40, 41, 42, 43, 44, 45, 46]
    assert np.flatnonzero(exact[2, 20]).tolist() == [15, 16, 17, 18, 19]
    assert np.flatnonzero(wide[3, :, 30]).tolist() == [3, 4, 5, 6, 7, 8, 9]
    assert not wide[1].any()
    assert not wide[:, :3].any()
