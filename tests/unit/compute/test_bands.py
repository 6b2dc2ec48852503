import os
import threading

import numpy as np
import pytest

from rig.compute.bands import run_both, run_in_bands, run_side_by_side


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


def test_both_come_back_each_in_its_place() -> None:
    assert run_both(lambda: 1, lambda: "two") == (1, "two")


@pytest.mark.parametrize("bad", [0, 9])
def test_an_error_in_any_band_comes_out(bad: int) -> None:
    def work(start: int, stop: int) -> None:
        if start <= bad < stop:
            raise ArithmeticError(bad)

    with pytest.raises(ArithmeticError, match=str(bad)):
        run_in_bands(work, 10)
    run_in_bands(lambda _start, _stop: None, 10)


@pytest.mark.parametrize(
    ("count", "bands"),
    [
        (20, [3] * 2 + [2] * 7),
        (9, [1] * 9),
        (8, [1] * 8),
        (2, [1, 1]),
        (1, [1]),
        (0, [0]),
    ],
)
def test_there_are_three_bands_for_every_thread_and_none_is_empty(
    count: int, bands: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIG_THREADS", "3")
    found: list[tuple[int, int]] = []
    run_in_bands(lambda start, stop: found.append((start, stop)), count)
    assert sorted((stop - start for start, stop in found), reverse=True) == bands


def test_a_thread_that_is_held_up_delays_only_its_own_band(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("RIG_THREADS", "2")
    caller, done = threading.current_thread(), threading.Semaphore(0)
    taken: dict[int, bool] = {}

    def work(start: int, _stop: int) -> None:
        is_caller = threading.current_thread() is caller
        taken[start] = is_caller
        if is_caller:
            done.release()
        else:  # the other one is stuck in its first band until the caller has done all others
            assert all(done.acquire(timeout=30) for _ in range(5))

    run_in_bands(work, 6)
    assert sorted(taken) == list(range(6))
    assert sum(taken.values()) >= 5


def test_nothing_runs_on_when_the_caller_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_THREADS", "2")
    caller, running = threading.current_thread(), []
    begun, failing = threading.Event(), threading.Event()

    def work(_start: int, _stop: int) -> None:
        if threading.current_thread() is caller:
            assert begun.wait(30)
            failing.set()
            raise KeyboardInterrupt
        running.append(1)
        begun.set()
        assert failing.wait(30)  # else it may have done all bands before the caller takes one
        running.pop()

    with pytest.raises(KeyboardInterrupt):
        run_in_bands(work, 8)
    assert running == []


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork")
def test_a_forked_process_has_threads_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_THREADS", "2")

    def meet() -> None:
        together = threading.Barrier(2, timeout=30)

        def work(_start: int, _stop: int) -> None:
            together.wait()

        run_in_bands(work, 2)

    meet()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            meet()
            code = 0
        finally:
            os._exit(code)
    assert os.waitpid(child, 0)[1] == 0


def test_bands_run_on_as_many_threads_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_THREADS", "3")
    together = threading.Barrier(3, timeout=30)  # broken, hence an error, if one of them is missing
    names: set[str] = set()

    def work(_start: int, _stop: int) -> None:
        together.wait()
        names.add(threading.current_thread().name)

    run_in_bands(work, 3)
    assert len(names) == 3


def test_one_thread_is_that_of_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_THREADS", "1")
    names: list[str] = []
    run_in_bands(lambda _a, _b: names.append(threading.current_thread().name), 100)
    assert names == [threading.current_thread().name]
