"""What an OAK camera counts as lost between two groups that it was given, and what ends it."""

from types import SimpleNamespace
from typing import Any

import pytest
from rig_drivers.oak.sdk import dai
from rig_drivers.oak.streams import Group, Streams

from rig.errors import DeviceLostError
from tests.support.oak import OakRig

VIEWS = ("centre", "left", "right", "top")


def group(number: int, *sequences: int) -> Group:
    frames: dict[str, dai.ImgFrame] = {}
    for view, sequence in zip(VIEWS, sequences, strict=True):
        frames[view] = dai.ImgFrame()
        frames[view].setSequenceNum(sequence)
    return Group(frames, number)


@pytest.mark.parametrize(
    ("after", "late", "unpaired"),
    [
        (group(4, 11, 21, 31, 41), 0, 0),
        (group(5, 12, 22, 32, 42), 1, 0),
        (group(4, 12, 22, 32, 42), 0, 1),
        (group(4, 12, 21, 33, 41), 0, 2),
        (group(6, 15, 25, 35, 45), 2, 2),
        (group(6, 11, 21, 31, 41), 2, 0),
    ],
)
def test_groups_are_overwritten_and_frames_find_no_partner(after: Group, late: int, unpaired: int):
    camera = OakRig().camera()
    camera._dropped = {"late": 0, "unpaired": 0}
    camera._next_number = 0
    camera._count_lost(None, group(3, 10, 20, 30, 40))
    assert camera._dropped == {"late": 0, "unpaired": 0}
    camera._count_lost(group(3, 10, 20, 30, 40), after)
    assert camera._dropped == {"late": late, "unpaired": unpaired}
    assert camera._next_number == late + unpaired


def streams(of_sensors: str | None, of_nodes: str | None, *, is_running: bool | None) -> Any:
    """Streams of a pipeline in a certain state; None for no pipeline at all."""
    return SimpleNamespace(
        _sensors=SimpleNamespace(name="oak", failure=lambda: of_sensors),
        _failures=SimpleNamespace(first=lambda: of_nodes),
        _pipeline=None if is_running is None else SimpleNamespace(isRunning=lambda: is_running),
    )


@pytest.mark.parametrize(
    ("of_sensors", "of_nodes", "is_running", "told"),
    [
        (None, None, False, "the pipeline ended by itself"),
        ("no power", "a node broke", False, "no power"),
        (None, "a node broke", True, "a node broke"),
        ("no power", None, None, "no power"),
    ],
)
def test_what_ends_a_stream_is_told(
    of_sensors: str | None, of_nodes: str | None, is_running: bool | None, told: str
):
    with pytest.raises(DeviceLostError, match=told):
        Streams._require_alive(streams(of_sensors, of_nodes, is_running=is_running))


@pytest.mark.parametrize("is_running", [True, None])
def test_a_stream_that_runs_or_has_not_begun_is_alive(is_running: bool | None):
    assert Streams._require_alive(streams(None, None, is_running=is_running)) is None
