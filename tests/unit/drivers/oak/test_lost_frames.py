"""What an OAK camera counts as lost between two groups that it was given."""

import pytest
from rig_drivers.oak.sdk import dai
from rig_drivers.oak.streams import Group

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
