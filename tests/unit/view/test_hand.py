"""What a person at the page is asked, and what counts as the answer."""

import threading

from rig.view.hand import PageHand

AT_ONCE_S, SOON_S = 0.0, 20.0


def test_a_page_answers_the_question_that_it_shows():
    hand = PageHand()
    changes: list[object] = []
    hand.on_change = lambda: changes.append(hand.asked)
    hand.ask("Put it at 450 mm")
    assert hand.asked == {"number": 1, "text": "Put it at 450 mm"}
    assert hand.answer(AT_ONCE_S) is None
    assert hand.say("450.8") == "the board stands at 450.8 mm"
    assert hand.answer(AT_ONCE_S) == "450.8"
    assert hand.answer(AT_ONCE_S) is None
    hand.settle()
    assert changes == [{"number": 1, "text": "Put it at 450 mm"}, None]


def test_the_second_press_answers_nothing():
    hand = PageHand()
    hand.ask("first")
    assert hand.say("") == "the board stands there"
    assert hand.say("") == "nobody asks for the board now"
    hand.answer(AT_ONCE_S)
    hand.settle()
    assert hand.say("") == "nobody asks for the board now"
    hand.ask("second")
    assert hand.answer(AT_ONCE_S) is None
    assert hand.asked == {"number": 2, "text": "second"}


def test_what_was_said_to_an_older_question_is_forgotten():
    hand = PageHand()
    hand.ask("first")
    hand.say("")
    hand.ask("second")
    assert hand.answer(AT_ONCE_S) is None


def test_an_answer_wakes_whoever_waits():
    hand = PageHand()
    hand.ask("first")
    heard: list[str | None] = []
    waiting = threading.Thread(target=lambda: heard.append(hand.answer(SOON_S)))
    waiting.start()
    hand.say("400")
    waiting.join(SOON_S)
    assert heard == ["400"]
