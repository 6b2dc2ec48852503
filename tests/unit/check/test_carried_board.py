"""What the board tells from its size in the picture alone, against a pinhole in closed form."""

from dataclasses import fields

import numpy as np
import pytest

from rig.check import carried_board
from rig.check.bench import BoardAtStop
from rig.epipolar.board.slope import BoardSlope
from rig.frames import Frame, MultiView
from rig.profile import CheckerboardConfig
from rig.profile.load import load_profile

FOCAL_PX, FOCUS_MM, DISTANCE_MM, SQUARE_MM, PITCH_MM = 610.0, 700.0, 830.0, 25.0, 40.0


def slope_px(distance_mm: float) -> float:
    return PITCH_MM * FOCAL_PX * (1.0 / distance_mm - 1.0 / FOCUS_MM)


def test_the_change_of_slope_with_distance_follows_from_the_side_of_a_square():
    profile = load_profile("sim")
    assert isinstance(profile.target, CheckerboardConfig)
    assert (profile.pitch_mm, profile.target.square_mm) == (PITCH_MM, SQUARE_MM)
    unknown = dict.fromkeys((field.name for field in fields(BoardSlope)), np.nan)
    slope = BoardSlope(**unknown | {"side_px": FOCAL_PX * SQUARE_MM / DISTANCE_MM})  # pyright: ignore[reportArgumentType]
    dark = MultiView((Frame("centre", np.zeros((2, 2), np.uint8), 0.0, 0),))
    found = carried_board._slope_per_mm(profile, BoardAtStop(DISTANCE_MM, dark, (), slope))
    step_mm = 0.01
    exact = (slope_px(DISTANCE_MM + step_mm) - slope_px(DISTANCE_MM - step_mm)) / (2.0 * step_mm)
    assert found == pytest.approx(exact, rel=1e-6)
