"""`rig devices` on this machine, whatever is plugged in."""

import pytest

from tests.support.command import Command


def test_no_search_holds_up_the_answer_and_nothing_is_hidden(rig: Command):
    """DepthAI cannot answer that fast: its silence is a note and no error."""
    answer = rig("devices", "--timeout-s", "0.1", "--json")
    assert answer.code == 0
    assert set(answer.json) == {"oak", "v4l2", "serial"}
    assert "--timeout-s" in answer.json["oak"]["note"]
    assert answer.json["oak"]["devices"] == []


@pytest.mark.slow
def test_every_search_answers(rig: Command):
    pytest.importorskip("depthai")
    answer = rig("devices", "--timeout-s", "60", "--json")
    assert answer.code == 0
    assert [found["note"] for found in answer.json.values()] == [None, None, None]
    assert answer.json["serial"]["key"] == "stage.port"


def test_words_say_what_to_do_next(rig: Command):
    answer = rig("devices", "--timeout-s", "0.1")
    assert answer.code == 0
    assert "OAK cameras: none" in answer.out
    last = answer.out.splitlines()[-1]
    assert "rig sweep sim" in last or "rig profile new" in last
