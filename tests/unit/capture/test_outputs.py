"""Outputs beside each other: none slows another one, and every frame that one misses counts."""

import pytest

from rig.capture.output import WantedOutput
from rig.capture.output_thread import OutputThread
from rig.capture.outputs import Outputs, open_outputs
from rig.errors import OutputError, RigError
from tests.unit.capture.scripted import ScriptedOutput, frames
from tests.unit.live.devices import tiny_rig


def shown(output: ScriptedOutput, *, room: int = 1, patience_s: float = 60.0) -> OutputThread:
    return OutputThread(output, is_kept=False, room=room, waits=False, patience_s=patience_s)


def kept(output: ScriptedOutput, *, room: int = 2, patience_s: float = 60.0) -> OutputThread:
    return OutputThread(output, is_kept=True, room=room, waits=True, patience_s=patience_s)


def test_a_slow_output_gets_the_newest_and_the_others_all():
    slow, fast = ScriptedOutput("view", is_open=False), ScriptedOutput("files")
    told: list[str] = []
    outputs = Outputs((shown(slow, room=2), kept(fast)), told.append)
    first, *others = frames(6)
    outputs.offer(first)
    assert slow.began.acquire(timeout=60.0)  # it is busy with the first
    for frame in others:
        outputs.offer(frame)
    slow.gate.set()
    outputs.finish()
    assert (slow.taken, fast.taken) == ([0, 4, 5], [0, 1, 2, 3, 4, 5])
    view, files = outputs.summaries
    assert (view.name, view.is_kept, view.written, view.dropped) == ("view", False, 3, 3)
    assert (files.name, files.is_kept, files.written, files.dropped) == ("files", True, 6, 0)
    assert (slow.closed, fast.closed) == (1, 1)
    assert told == []


def test_an_output_that_fails_is_closed_once_said_once_and_left_out():
    full, fine = ScriptedOutput("files", fails_at=1), ScriptedOutput("recording")
    told: list[str] = []
    outputs = Outputs((kept(full), kept(fine)), told.append)
    for frame in frames(5):
        outputs.offer(frame)
    assert outputs.take_frames
    outputs.finish()
    assert (full.taken, full.closed) == ([0], 1)
    assert fine.taken == [0, 1, 2, 3, 4]
    files, recording = outputs.summaries
    assert (files.written, files.dropped) == (1, 4)
    assert (recording.written, recording.dropped) == (5, 0)
    assert str(files.failure) == "the disk is full; make room"
    assert recording.failure is None
    (line,) = told
    assert line.startswith("rig: files: the disk is full; make room; ")


def test_where_every_output_has_failed_none_takes_frames():
    full = ScriptedOutput(fails_at=0)
    thread = kept(full, room=1)
    outputs = Outputs((thread,), lambda _: None)
    assert outputs.take_frames
    for frame in frames(3):  # the second waits until the first has failed
        outputs.offer(frame)
    assert not outputs.take_frames
    assert Outputs((), lambda _: None).take_frames
    assert thread.finish().dropped == 3


def test_what_cannot_be_closed_has_failed():
    told: list[str] = []
    outputs = Outputs((kept(ScriptedOutput(fails_at="close")),), told.append)
    outputs.offer(frames(1)[0])
    outputs.finish()
    (files,) = outputs.summaries
    assert (files.written, files.dropped) == (1, 0)
    assert isinstance(files.failure, RigError)
    assert told == ["rig: files: the disk is full; make room; it is not whole"]


@pytest.mark.parametrize("waits", [True, False])
def test_an_output_that_hangs_is_given_up_and_the_capture_goes_on(*, waits: bool):
    hanging = ScriptedOutput("view", is_open=False)
    now_s = [0.0]
    thread = OutputThread(
        hanging, is_kept=waits, room=2, waits=waits, patience_s=3.0, clock_s=lambda: now_s[0]
    )
    first, second, third, late = frames(4)
    thread.offer(first)
    assert hanging.began.acquire(timeout=60.0)
    now_s[0] = 2.99
    thread.offer(second)
    thread.offer(third)
    assert thread.failure is None
    now_s[0] = 3.0
    thread.offer(late)
    summary = thread.finish()
    with pytest.raises(OutputError, match=r"view: no answer within 3 s, given up with 2 frames"):
        raise summary.failure or AssertionError
    assert (summary.written, summary.dropped) == (0, 4)
    hanging.gate.set()


def test_an_output_that_hangs_at_the_end_is_given_up():
    hanging = ScriptedOutput("view", is_open=False)
    thread = shown(hanging, patience_s=0.01)
    thread.offer(frames(1)[0])
    assert "given up with" in str(thread.finish().failure)
    hanging.gate.set()


def test_a_mistake_in_an_output_is_not_hidden():
    thread = kept(ScriptedOutput(error=ZeroDivisionError("seven"), fails_at=0), room=1)
    first, *others = frames(3)
    thread.offer(first)
    with pytest.raises(ZeroDivisionError, match="seven"):
        for frame in others:
            thread.offer(frame)
    slow = ScriptedOutput("recording")
    with pytest.raises(ZeroDivisionError, match="seven"):
        Outputs((thread, kept(slow)), lambda _: None).finish()
    assert slow.closed == 1


def test_where_one_output_cannot_be_opened_the_others_are_closed():
    opened = ScriptedOutput("page")
    refusal = RigError("the port is taken", advice="choose another")

    def refused(_: object) -> ScriptedOutput:
        raise refusal

    wanted = [WantedOutput(lambda _: opened, is_kept=False), WantedOutput(refused, is_kept=False)]
    with tiny_rig()[0] as camera, pytest.raises(RigError, match="the port is taken"):
        open_outputs(camera, wanted, waits=True, tell=lambda _: None)
    assert (opened.closed, opened.taken) == (1, [])
