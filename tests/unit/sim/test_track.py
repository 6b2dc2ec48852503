"""Where the camera of a simulated scan is, against closed forms."""

import math

import numpy as np
import pytest
from rig_sim.clock import VirtualClock
from rig_sim.track import direction, track_of

from rig.errors import ConfigError
from rig.profile.load import load_profile
from rig.profile.world import SliderConfig


def slider(**values: float) -> SliderConfig:
    return SliderConfig.model_validate({"camera_at_machine_zero_mm": 80.0, **values})


def test_the_direction_of_a_row_leaves_rows_and_plane_by_its_angles():
    found = direction(slider(forward_deg=30.0, roll_deg=60.0), "row")
    half, root = 0.5, math.sqrt(3.0) / 2.0
    np.testing.assert_allclose(found, [root * half, root * root, half], atol=1e-12)


def test_the_direction_of_a_column_turns_the_same_way():
    found = direction(slider(roll_deg=90.0), "column")
    np.testing.assert_allclose(found, [-1.0, 0.0, 0.0], atol=1e-12)


def test_the_reference_stands_where_its_machine_coordinate_and_scale_put_it():
    rig = load_profile("sim-scan", ["world.slider.forward_deg=0.0", "world.slider.roll_deg=0.0"])
    track = track_of(rig, VirtualClock())
    assert track is not None
    # Driver 0 mm is machine -80 mm; 80 mm of the screw are 80.08 mm.
    np.testing.assert_allclose(track.reference_mm, [80.0 - 80.08, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(track.place_mm({"camera": -40.0}), [39.96, 0.0, 0.0], atol=1e-9)


def test_a_track_sags_with_the_square_of_the_way():
    more = ("forward_deg=0.0", "roll_deg=0.0", "scale=1.0", "bow_mm=0.4", "bow_length_mm=40.0")
    rig = load_profile("sim-scan", [f"world.slider.{text}" for text in more])
    track = track_of(rig, VirtualClock())
    assert track is not None
    np.testing.assert_allclose(track.place_mm({"camera": -100.0}), [-20.0, 0.1, 0.0], atol=1e-12)


def test_cameras_that_stand_have_no_track():
    assert track_of(load_profile("sim"), VirtualClock()) is None


def test_a_world_without_a_slider_is_told():
    rig = load_profile("sim-scan")
    assert rig.world is not None
    bare = rig.model_copy(update={"world": rig.world.model_copy(update={"slider": None})})
    with pytest.raises(ConfigError, match=r"needs \[world.slider\]"):
        track_of(bare, VirtualClock())
