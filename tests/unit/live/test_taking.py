"""Taking beside measuring: the newest wins, what is stored waits, nothing is left behind."""

import threading
from collections.abc import Generator, Iterable

import numpy as np
import pytest

from rig.errors import DeviceLostError
from rig.frames import Frame, MultiView
from rig.live.ahead import Ahead
from rig.live.measure import Rectified
from rig.live.taking import Rules, Taken, TakingOnDemand, TakingThread

LOST = DeviceLostError("camera a", "is gone", advice="plug it in")


def shown(number: int, *, skew_s: float = 0.0) -> MultiView:
    image = np.zeros((2, 2), np.uint8)
    return MultiView(
        (Frame("a", image, 1.0 * number, number), Frame("b", image, number + skew_s, number))
    )


def numbers(taken: Iterable[Taken]) -> list[int]:
    return [one.views.frames[0].sequence for one in taken]


class Driver:
    """A stream that gives what a test lets through, one by one."""

    def __init__(self, *given: MultiView | Exception) -> None:
        self._given = given
        self._let = threading.Semaphore(0)
        self.taken = threading.Semaphore(0)
        """One for each multi-view after which the next one was asked for."""
        self.is_closed = threading.Event()
        self.counted: list[str] = []
        self.rules = Rules(self._stamp, 0.25, self.counted.append)

    def stream(self) -> Generator[MultiView]:
        try:
            for one in self._given:
                assert self._let.acquire(timeout=60.0)
                if isinstance(one, Exception):
                    raise one
                yield one
                self.taken.release()
        finally:
            self.is_closed.set()

    def let(self, count: int) -> None:
        """Let so many through, and wait until they are taken."""
        for _ in range(count):
            self._let.release()
            assert self.taken.acquire(timeout=60.0)

    def let_last(self) -> None:
        """Let one through, after which nothing is asked for."""
        self._let.release()

    def _stamp(self, views: MultiView) -> Taken:
        return Taken(views, age_s=0.0, time_ns=0, handed_over_s=0.0)


def live(driver: Driver) -> TakingThread:
    return TakingThread(driver.stream(), driver.rules, room=1, waits=False)


def stored(driver: Driver, before: Iterable[Taken] = (), *, room: int = 2) -> TakingThread:
    return TakingThread(driver.stream(), driver.rules, room=room, waits=True, before=before)


def taken_of(taking: TakingThread | TakingOnDemand, count: int) -> list[int]:
    found = [taking.next() for _ in range(count)]
    return numbers(one for one in found if one is not None)


def test_the_newest_is_given_and_what_it_replaced_counts():
    driver = Driver(*(shown(n) for n in range(6)))
    taking = live(driver)
    driver.let(3)
    assert taken_of(taking, 1) == [2]
    driver.let(1)
    assert taken_of(taking, 1) == [3]
    assert driver.counted == ["estimate", "estimate"]
    driver.let_last()
    assert taken_of(taking, 1) == [4]
    driver.let_last()
    assert taken_of(taking, 2) == [5]  # and then None
    assert taking.stop() == []
    assert driver.is_closed.is_set()


def test_two_newer_ones_make_it_stale():
    driver = Driver(*(shown(n) for n in range(4)))
    taking = live(driver)
    driver.let(1)
    first = taking.next()
    assert first is not None
    assert not taking.is_stale(first)
    driver.let(1)
    assert not taking.is_stale(first)
    driver.let(1)
    assert taking.is_stale(first)
    driver.let_last()
    assert len(taking.stop()) <= 1


def test_an_error_comes_after_what_was_taken_before_it():
    driver = Driver(shown(0), LOST)
    taking = live(driver)
    driver.let(1)
    driver.let_last()
    assert taken_of(taking, 1) == [0]
    with pytest.raises(DeviceLostError) as told:
        taking.next()
    assert told.value is LOST
    assert taking.stop() == []


def test_stored_multiviews_wait_and_are_kept_for_the_next_loop():
    driver = Driver(*(shown(n) for n in range(9)))
    taking = stored(driver, room=2)
    driver.let(2)
    driver.let_last()  # the third is taken and waits for room
    assert taken_of(taking, 1) == [0]
    assert driver.taken.acquire(timeout=60.0)
    driver.let_last()
    left = taking.stop()
    assert numbers(left) in ([1, 2], [1, 2, 3])
    assert driver.counted == []
    again = Driver(*(shown(n) for n in range(left[-1].views.frames[0].sequence + 1, 6)))
    taking = stored(again, left, room=9)
    for _ in range(5 - left[-1].views.frames[0].sequence):
        again.let_last()
    assert taken_of(taking, 5) == [1, 2, 3, 4, 5]
    assert taking.next() is None
    taking.stop()


def test_views_out_of_step_are_left_out_and_counted():
    driver = Driver(shown(0), shown(1, skew_s=0.375), shown(2, skew_s=0.25))
    on_demand = TakingOnDemand(driver.stream(), driver.rules)
    for _ in range(3):
        driver.let_last()
    assert taken_of(on_demand, 2) == [0, 2]
    assert on_demand.next() is None
    assert driver.counted == ["skew"]


def test_who_waits_is_woken_and_gets_nothing():
    driver = Driver(shown(0))
    taking = live(driver)
    answers: list[Taken | None] = []
    waiting = threading.Thread(target=lambda: answers.append(taking.next()))
    waiting.start()
    taking.wake()
    waiting.join(60.0)
    assert answers == [None]
    driver.let_last()
    taking.stop()
    assert driver.is_closed.is_set()


def test_who_grabs_waits_for_what_is_being_taken_no_longer_than_told():
    driver = Driver(shown(0), shown(1))
    taking = live(driver)
    driver.let(1)  # it asks for the next one now
    with taking.paused(0.0) as is_free:
        assert not is_free
    driver.let_last()
    assert driver.taken.acquire(timeout=60.0)
    with taking.paused(60.0) as is_free:  # the stream has ended
        assert is_free
    taking.stop()


def ahead_of(driver: Driver, taking: TakingThread) -> tuple[Ahead, list[str]]:
    threads: list[str] = []

    def rectify(taken: Taken) -> Rectified:
        threads.append(threading.current_thread().name)
        return Rectified(taken, views=None, took_s=0.0)  # pyright: ignore[reportArgumentType]

    return Ahead(taking, rectify, driver.counted.append), threads


def given(ahead: Ahead) -> list[int]:
    found = ahead.next()
    return [] if found is None else numbers([found.taken])


def test_what_was_begun_is_rectified_on_a_thread_of_its_own():
    driver = Driver(*(shown(n) for n in range(3)))
    ahead, threads = ahead_of(driver, live(driver))
    driver.let(1)
    assert given(ahead) == [0]
    ahead.begin()
    ahead.begin()
    driver.let(1)
    assert given(ahead) == [1]
    driver.let_last()
    assert given(ahead) == [2]
    assert threads == [threading.current_thread().name, "rectify", threading.current_thread().name]
    assert driver.counted == []
    assert given(ahead) == []
    assert ahead.stop() == []


def test_what_was_begun_and_is_stale_gives_way_to_the_newest():
    driver = Driver(*(shown(n) for n in range(9)))
    taking = live(driver)
    ahead, threads = ahead_of(driver, taking)
    ahead.begin()
    driver.let(1)
    while not threads:  # until it is rectified
        threading.Event().wait(0.001)
    driver.let(3)
    assert given(ahead) == [3]
    assert driver.counted == ["estimate"] * 3
    driver.let_last()
    ahead.stop()


def test_stored_multiviews_that_were_begun_are_not_lost():
    driver = Driver(shown(0), shown(1), shown(2))
    ahead, _ = ahead_of(driver, stored(driver))
    ahead.begin()
    for _ in range(3):
        driver.let_last()
    first = ahead.next_taken()
    assert first is not None
    assert numbers([first]) == [0]
    ahead.begin()
    assert driver.is_closed.wait(60.0)
    assert numbers(ahead.stop()) == [1, 2]


def test_no_thread_is_left_behind():
    before = set(threading.enumerate())
    driver = Driver(shown(0), shown(1), LOST)
    ahead, _ = ahead_of(driver, live(driver))
    assert {t.name for t in set(threading.enumerate()) - before} == {"take", "rectify"}
    ahead.begin()
    driver.let_last()
    assert given(ahead) == [0]
    driver.let_last()
    ahead.stop()
    assert set(threading.enumerate()) == before
