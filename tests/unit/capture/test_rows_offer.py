"""A capture whose rows do not meet offers what brings them together, once."""

from dataclasses import replace

import numpy as np

from rig.capture.rows_offer import RowsOffer
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.row_errors import RowErrors
from rig.live.frame import DepthFrame
from rig.profile.load import load_profile
from tests.unit.capture.scripted import one_frame

PAIR = load_profile("checkerboard-stereo")


def frame_with(*rms_px: float) -> DepthFrame:
    views = len(rms_px)
    worst = tuple(f"{2 * rms:.1f} px low at the top left" if rms else "" for rms in rms_px)
    rows = RowErrors(
        (None,) * views, np.zeros((views, 2)), np.array(rms_px), worst, np.zeros(views)
    )
    frame = one_frame()
    return replace(frame, slopes=replace(frame.slopes, mending=Mending(rows, ())))


def test_rows_that_do_not_meet_are_told_with_what_mends_them_once():
    said: list[str] = []
    offer = RowsOffer(PAIR, said.append)
    for frame in (frame_with(0.0, 0.0), frame_with(0.0, 0.75), frame_with(0.0, 0.9)):
        offer.look(frame)
    assert said == [
        f"rows do not meet: {PAIR.views[1].name} is 1.5 px low at the top left (0.75 px rms); "
        "mended in every frame, once and for all by `rig calibrate checkerboard-stereo "
        "--from-scene`, or with a board"
    ]


def test_a_view_that_is_left_out_has_no_name():
    said: list[str] = []
    RowsOffer(PAIR, said.append).look(frame_with(0.0, 0.0, 0.5))
    assert "a view is 1.0 px low" in said[0]


def test_frames_that_nobody_mended_are_passed_by():
    said: list[str] = []
    frame = one_frame()
    RowsOffer(PAIR, said.append).look(replace(frame, slopes=replace(frame.slopes, mending=None)))
    assert said == []
