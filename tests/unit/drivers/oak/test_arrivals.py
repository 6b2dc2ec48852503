"""A link that is too slow, told by what arrives."""

import logging

import pytest
from rig_drivers.oak.arrivals import Arrivals, Seen


def arrivals(link: str = "gigabit Ethernet") -> Arrivals:
    return Arrivals("camera OAK 1", link=link, needed_mb_s=20.0, rate_hz=10.0)


def feed(watch: Arrivals, groups: list[int], frames: list[int]) -> None:
    for group, frame in zip(groups, frames, strict=True):
        watch.saw(Seen(group, {"left": frame, "right": frame}))


def test_half_of_the_pictures_over_ethernet_is_a_link_of_100_megabit(
    caplog: pytest.LogCaptureFixture,
):
    watch = arrivals()
    with caplog.at_level(logging.WARNING):
        feed(watch, list(range(41)), list(range(0, 82, 2)))
    assert watch.problem == (
        "camera OAK 1: 15 of 30 multi-views arrive whole over gigabit Ethernet, 10.0 of 20.0 "
        "MB/s, as over Ethernet of 100 Mbit/s; use a gigabit switch and a cable with all four "
        "pairs, or lower camera.rate_hz to 5.0"
    )
    assert caplog.text.count("arrive whole") == 1, "it is said once"


def test_where_more_arrives_than_100_megabit_the_cause_is_another():
    watch = arrivals()
    feed(watch, list(range(0, 31)), [4 * n // 3 for n in range(31)])
    assert watch.problem is not None
    assert "23 of 30 multi-views" in watch.problem
    assert "look for a busy link or a bad cable, or lower camera.rate_hz to 7.7" in watch.problem
    usb = arrivals("USB 3")
    feed(usb, list(range(41)), list(range(0, 82, 2)))
    assert usb.problem is not None
    assert "100 Mbit" not in usb.problem


@pytest.mark.parametrize(("arrived", "is_told"), [(24, False), (23, True)])
def test_a_fifth_may_be_lost(arrived: int, is_told: bool):
    watch = arrivals()
    feed(watch, [0, arrived], [0, 30])
    assert (watch.problem is not None) == is_told


def test_a_few_frames_tell_nothing():
    watch = arrivals()
    feed(watch, [0, 1], [0, 29])
    assert watch.problem is None


def test_what_nobody_takes_out_has_arrived_all_the_same():
    """Between two grabs of a sweep many groups pass by; their numbers go on."""
    watch = arrivals()
    feed(watch, [0, 200, 420], [5, 206, 430])
    assert watch.problem is None


def test_every_stretch_is_judged_by_itself():
    watch = arrivals()
    feed(watch, [0, 1000, 1010], [0, 1000, 1040])
    assert watch.problem is not None
    assert "10 of 40 multi-views" in watch.problem
