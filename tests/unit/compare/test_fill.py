import numpy as np

from rig.compare.fill import fill_background

NO = np.nan


def test_a_hole_takes_the_farther_neighbour():
    holes = np.array([[5, NO, NO, 2, NO], [NO, 1, NO, 7, 7]], np.float32)
    filled = [[5, 2, 2, 2, 2], [1, 1, 1, 7, 7]]
    np.testing.assert_array_equal(fill_background(holes), filled)


def test_an_empty_row_takes_the_rows_beside_it():
    holes = np.array([[3, NO], [NO, NO], [1, 8]], np.float32)
    np.testing.assert_array_equal(fill_background(holes), [[3, 3], [1, 3], [1, 8]])


def test_nothing_comes_from_nothing():
    assert np.isnan(fill_background(np.full((3, 4), NO, np.float32))).all()
