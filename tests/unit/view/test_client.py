"""What one page has been sent, and what it has drawn."""

import numpy as np

from rig.view.client import IN_FLIGHT, Client, Sent
from rig.view.message import PlainMessage
from rig.view.wire import decode


def sent(number: int, published_s: float = 0.0) -> Sent[PlainMessage]:
    return Sent(number, PlainMessage("capture", {}), published_s)


def client() -> Client[PlainMessage]:
    return Client("127.0.0.1")


def test_two_are_on_their_way_and_no_more():
    one = client()
    assert IN_FLIGHT == 2
    one.sends(sent(4))
    assert one.has_credit
    one.sends(sent(9))
    assert not one.has_credit
    assert one.acknowledged(4, 1.0)
    assert one.has_credit
    assert one.shown is not None
    assert one.shown.number == 4


def test_what_it_was_not_sent_is_counted_from_its_first_on():
    one = client()
    one.sends(sent(40))
    assert one.skipped == 0
    one.sends(sent(41))
    assert one.skipped == 0
    one.acknowledged(41, 1.0)
    one.sends(sent(45))
    assert one.skipped == 3


def test_a_later_word_settles_what_came_before():
    one = client()
    one.sends(sent(1, 10.0))
    one.sends(sent(2, 10.5))
    assert one.acknowledged(2, 10.6)
    assert one.has_credit
    assert one.shown is not None
    assert one.shown.number == 2
    assert one.age_s() == 10.6 - 10.5


def test_words_about_what_was_never_sent_change_nothing():
    one = client()
    one.sends(sent(1))
    one.sends(sent(2))
    assert not one.acknowledged(7, 1.0)
    assert not one.has_credit
    assert one.shown is None


def test_the_age_is_the_median_of_what_was_drawn():
    one = client()
    assert one.age_s() is None
    for number, took_s in enumerate((0.5, 0.1, 0.2)):
        one.sends(sent(number, 1.0))
        one.acknowledged(number, 1.0 + took_s)
    assert abs((one.age_s() or 0.0) - 0.2) < 1e-12


def test_a_frozen_page_gets_nothing_and_is_not_stalled():
    one = client()
    one.sends(sent(1, 0.0))
    assert not one.is_stalled(10.0)
    assert one.is_stalled(10.1)
    one.is_frozen = True
    assert not one.is_stalled(10.1)
    assert not one.has_credit


def test_who_asks_for_more_gets_the_newest_again():
    one = client()
    one.sends(sent(7))
    one.asks_for(frozenset({"sigma"}))
    assert one.last == 7
    one.asks_for(frozenset({"sigma", "slope"}))
    assert one.last == 6
    assert one.wants == {"sigma", "slope"}
    one.sends(sent(7))
    assert one.skipped == 0


def test_a_plain_message_is_for_everybody():
    message = PlainMessage("sweep", {"stop": 3}, {"corners": np.array([1.5], np.float32)})
    header, arrays = decode(message.encoded(12, frozenset()))
    assert header == {"mode": "sweep", "number": 12, "stop": 3}
    assert arrays["corners"].tolist() == [1.5]
    assert message.encoded(12, frozenset({"views"})) == message.encoded(12, frozenset())
