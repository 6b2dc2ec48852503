import numpy as np
import pytest

from rig.compute.bands import run_in_bands, run_side_by_side


def test_bands_cover_every_index_once_even_within_bands() -> None:
    hits = np.zeros((5, 7), int)

    def rows(start: int, stop: int) -> None:
        for row in hits[start:stop]:

            def columns(first: int, last: int, row: np.ndarray = row) -> None:
                row[first:last] += 1

            run_in_bands(columns, len(row))

    run_in_bands(rows, len(hits))
    assert np.all(hits == 1)


def test_what_is_done_side_by_side_comes_back_in_order() -> None:
    assert run_side_by_side(lambda: 1, lambda: 2, lambda: 3) == [1, 2, 3]


@pytest.mark.parametrize("bad", [0, 9])
def test_an_error_in_any_band_comes_out(bad: int) -> None:
    def work(start: int, stop: int) -> None:
        if start <= bad < stop:
            raise ArithmeticError(bad)

    with pytest.raises(ArithmeticError, match=str(bad)):
        run_in_bands(work, 10)
    run_in_bands(lambda _start, _stop: None, 10)
