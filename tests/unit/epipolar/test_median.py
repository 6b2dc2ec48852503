import numpy as np

from rig.epipolar.median import guided_median, near_jumps


def test_a_fattened_edge_moves_back_to_the_grey_edge() -> None:
    columns = np.tile(np.arange(30), (20, 1))
    grey = np.where(columns < 15, 40.0, 160.0).astype(np.float32)
    fat = np.where(columns < 13, 0.0, 2.0).astype(np.float32)
    where = near_jumps(fat, 1.0, 4)
    moved = guided_median(fat, grey, where, radius_px=4, grey_scale=10.0)
    assert np.array_equal(moved, np.where(columns < 15, 0.0, 2.0))


def test_far_from_jumps_nothing_changes() -> None:
    rng = np.random.default_rng(0)
    slope = rng.uniform(0, 0.1, (20, 30)).astype(np.float32)
    where = near_jumps(slope, 1.0, 4)
    assert not where.any()
    assert np.array_equal(guided_median(slope, slope, where, radius_px=4, grey_scale=1.0), slope)
