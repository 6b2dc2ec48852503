"""One clear line each, and no flood."""

from rig.view.notices import Notices


def test_the_same_is_told_once_a_minute():
    told: list[str] = []
    now = [0.0]
    notices = Notices(told.append, lambda: now[0])
    for at_s in (0.0, 1.0, 59.9, 60.0, 61.0):
        now[0] = at_s
        notices.say("page opened")
    assert told == ["view: page opened"] * 2


def test_who_calls_differently_each_time_floods_nothing_either():
    told: list[str] = []
    now = [0.0]
    notices = Notices(told.append, lambda: now[0])
    for i in range(1000):
        notices.say(f"rubbish {i}")
    assert len(told) == 64
    now[0] = 60.0
    notices.say("rubbish 7")
    assert told[-1] == "view: rubbish 7"
    assert len(told) == 65
