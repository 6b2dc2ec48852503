"""A camera that goes away in a stream: how long it is looked for, and what is counted."""

from collections.abc import Generator, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from rig_sim.clock import VirtualClock

from rig.errors import DeviceLostError, DeviceNotFoundError
from rig.frames import Frame, MultiView
from rig.live.again import Reopening
from rig.live.frozen import frozen_views

LOST = DeviceLostError("camera a", "is gone", advice="plug it in")


def shown(number: int, *levels: int) -> MultiView:
    frames = [
        Frame(f"view {n}", np.full((4, 4), level, np.uint8), 0.1 * number, number)
        for n, level in enumerate(levels or (1, 2))
    ]
    return MultiView(tuple(frames))


class Comes:
    """A camera that goes away after each stream of a count below 0."""

    def __init__(self, streams: Sequence[int], *, looks: int = 1) -> None:
        self._streams = iter(streams)
        self._looks = looks
        self.looked = 0
        self.closed = 0
        self.dropped: Mapping[str, int] = {"skew": 2}

    def __enter__(self) -> "Comes":
        self.looked += 1
        if self.looked % self._looks:
            raise DeviceNotFoundError("camera a", "is not there")
        self.dropped = {"skew": 1, "late": 1}
        return self

    def __exit__(self, *_: object) -> None:
        self.closed += 1

    def stream(self) -> Generator[MultiView]:
        count = next(self._streams)
        for number in range(abs(count)):
            yield shown(number)
        if count < 0:
            raise LOST


def reopening(camera: Any, clock: VirtualClock, *, reconnect_s: float = 1.0) -> Reopening:
    return Reopening(camera, clock, reconnect_s=reconnect_s, is_over=lambda: False)


def test_a_camera_that_comes_back_streams_on_and_all_that_was_dropped_counts():
    camera, clock = Comes([-2, -1, 3], looks=2), VirtualClock()
    again = reopening(camera, clock)
    assert again.dropped == {"skew": 2}
    assert [one.frames[0].sequence for one in again.stream()] == [0, 1, 0, 0, 1, 2]
    assert (camera.looked, camera.closed) == (4, 2)
    # 2 before it went, 1 before it went again, 1 now; each look comes 0.2 s after the last.
    assert again.dropped == {"skew": 4, "late": 2, "reconnect": 2}
    assert clock.now_s() == pytest.approx(0.8)


def test_a_camera_that_stays_away_is_given_up_in_time():
    camera, clock = Comes([-1], looks=99), VirtualClock()
    with pytest.raises(
        DeviceLostError, match="looked for it for 1 s, it did not come back"
    ) as told:
        list(reopening(camera, clock).stream())
    assert told.value.advice == "plug it in"
    assert camera.looked == 5  # every 0.2 s
    assert clock.now_s() == pytest.approx(1.0)


def test_a_camera_that_is_not_to_be_looked_for_is_lost_at_once():
    camera, clock = Comes([-1]), VirtualClock()
    with pytest.raises(DeviceLostError, match="is gone") as told:
        list(reopening(camera, clock, reconnect_s=0.0).stream())
    assert told.value is LOST
    assert (camera.looked, camera.closed, clock.now_s()) == (0, 0, 0.0)


@pytest.mark.parametrize(("asked", "looks"), [(1, 0), (2, 0), (3, 1)])
def test_nobody_looks_for_a_camera_that_nobody_waits_for(asked: int, looks: int):
    camera, clock = Comes([-1], looks=99), VirtualClock()
    answers = iter([False] * (asked - 1) + [True] * 9)
    lost: Any = camera
    again = Reopening(lost, clock, reconnect_s=1.0, is_over=lambda: next(answers))
    with pytest.raises(DeviceLostError):
        list(again.stream())
    assert camera.looked == looks


def test_a_view_is_frozen_where_others_change():
    assert frozen_views(None, shown(0, 1, 2, 3)) == ()
    assert frozen_views(shown(0, 1, 2, 3), shown(1, 1, 9, 3)) == (0, 2)
    assert frozen_views(shown(0, 1, 2, 3), shown(1, 7, 8, 9)) == ()
    assert frozen_views(shown(0, 1, 2, 3), shown(1, 1, 2, 3)) == ()  # a scene that stands still
