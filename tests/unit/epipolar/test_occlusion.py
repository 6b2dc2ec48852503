import numpy as np

from rig.epipolar.occlusion import hidden_somewhere


def test_the_band_beside_a_near_square_is_hidden() -> None:
    slope = np.zeros((40, 60), np.float32)
    slope[10:30, 20:40] = 5.0
    hidden = hidden_somewhere(slope, np.array([-1.0, 0.0, 1.0]), np.zeros(3), 0.5)
    assert hidden[20, 15:20].all()
    assert hidden[20, 40:45].all()
    assert not hidden[20, :14].any()
    assert not hidden[20, 46:].any()
    assert not hidden[20, 20:40].any()
    assert not hidden[5].any()
