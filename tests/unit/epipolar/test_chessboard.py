import numpy as np
import pytest

from rig.epipolar.chessboard import double_row, doubled, filled, mean_around, thinned

SIZES = [(4, 6), (5, 7), (6, 5), (3, 2), (2, 3), (8, 8)]


def column(v: int, k: int, width: int) -> int:
    return min(2 * k + v % 2, width - 1)


def numbers(height: int, width: int) -> np.ndarray:
    return np.arange(height * width, dtype=np.float32).reshape(height, width)


@pytest.mark.parametrize(("height", "width"), SIZES)
@pytest.mark.parametrize("threads", ["1", "3"])
def test_a_thin_map_holds_the_pixels_of_one_colour(
    height: int, width: int, threads: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIG_THREADS", threads)
    values = numbers(height, width)
    thin = thinned(values)
    assert thin.shape == (height, (width + 1) // 2)
    expected = [
        [values[v, column(v, k, width)] for k in range(thin.shape[1])] for v in range(height)
    ]
    assert thin.tolist() == np.array(expected).tolist()


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_the_other_colour_is_taken_from_beside(height: int, width: int) -> None:
    values = numbers(height, width)
    full = doubled(thinned(values), width)
    for v in range(height):
        for u in range(width):
            is_first = u % 2 == v % 2
            beside = max(u - 1, min(1, width - 1)) if v % 2 else u - 1
            assert full[v, u] == values[v, u if is_first else beside]


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_rows_are_doubled_one_by_one_as_all_together(height: int, width: int) -> None:
    thin = thinned(numbers(height, width))
    rows = np.empty((height, width), np.float32)
    for v in range(height):
        double_row(thin[v], v % 2 == 1, rows[v])
    assert np.array_equal(rows, doubled(thin, width))
    double_row(numbers(1, width)[0] + 3, False, rows[0])
    assert rows[0].tolist() == [u + 3 for u in range(width)]


def test_a_mean_around_covers_about_the_same_window() -> None:
    thin = np.zeros((21, 15), np.float32)
    thin[10, 7] = 1.0
    around = mean_around(thin, 4)
    assert np.count_nonzero(around) == 9 * 5
    assert around.max() == np.float32(1 / 45)
    assert around[10 - 4, 7 - 2] > 0 == around[10 - 5, 7]


def spread(
    start: np.ndarray, variance: np.ndarray, slope: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    grey = np.full_like(start, 100.0)
    thin = thinned(start)
    return filled(
        thin if slope is None else slope, variance, thin, thinned(grey), start, grey,
        slope_gate_px=1.0, grey_gate=5.0,
    )  # fmt: skip


@pytest.mark.parametrize(("height", "width"), [(6, 8), (7, 9)])
def test_a_plane_is_filled_in_exactly(height: int, width: int) -> None:
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    plane = np.float32(0.125) * columns - np.float32(0.0625) * rows
    variance = np.full(thinned(plane).shape, 0.25, np.float32)
    slope, chance = spread(plane, variance)
    inner = (slice(1, -1), slice(1, -1))
    assert np.allclose(slope[inner], plane[inner], atol=1e-6)
    assert np.abs(slope - plane).max() <= 0.125
    assert np.allclose(chance, 0.25)


def test_what_is_filled_in_never_mixes_two_surfaces() -> None:
    step = np.where(np.arange(12) < 5, np.float32(-2), np.float32(3)) * np.ones((9, 1), np.float32)
    slope, chance = spread(step, np.ones(thinned(step).shape, np.float32))
    assert np.array_equal(slope, step)
    assert np.allclose(chance, 1.0)


def test_grey_values_that_differ_count_less() -> None:
    start = np.zeros((3, 3), np.float32)
    found, variance = np.zeros((3, 2), np.float32), np.ones((3, 2), np.float32)
    found[1, 0] = 0.5  # column 1 of row 1 is of the first colour; (0, 1) lies above it
    grey = np.zeros((3, 3), np.float32)
    grey[1, 1] = 5.0  # a gate away: counts a quarter
    slope, _ = filled(
        found, variance, np.zeros_like(found), thinned(grey), start, grey,
        slope_gate_px=1.0, grey_gate=5.0,
    )  # fmt: skip
    assert slope[0, 1] == pytest.approx(0.25 * 0.5 / 2.25)
    assert slope[1, 1] == 0.5


def test_where_no_neighbour_knows_anything_nothing_is_known() -> None:
    start = np.zeros((6, 6), np.float32)
    start[2, 3] = 7.0  # of the other colour, and of no surface around it
    variance = np.ones(thinned(start).shape, np.float32)
    variance[4, 2] = np.inf  # column 4 of row 4
    slope, chance = spread(start, variance)
    assert slope[2, 3] == 7.0
    assert np.isinf(chance[2, 3])
    assert np.isinf(chance[4, 4])
    assert chance[4, 3] == chance[4, 5] == 1.0
    assert np.count_nonzero(np.isinf(chance)) == 2
