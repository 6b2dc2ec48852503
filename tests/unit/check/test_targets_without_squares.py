"""A check of a rig whose target has no squares."""

import numpy as np
import pytest

from rig.check import geometry_drift
from rig.check.scene import judge_scene
from rig.errors import TargetError
from rig.frames import Frame, MultiView
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting
from rig.profile.load import parse_profile
from rig.targets import CircleGrid
from tests.support.circle_images import CircleScene

GRID = CircleGrid(4, 5, 24.0, 20.0)
POINTS_MM = GRID.points_mm.reshape(-1, 3)
LEFT = CircleScene(rows=5, spacing_mm=24.0, diameter_mm=20.0, tilt_deg=(35.0, -30.0, 8.0))
RIGHT = LEFT.with_changes(offset_mm=(-60.0, 0.0))
CAMERA = CameraModel(480, 320, 600.0, 600.0, 239.5, 159.5)
PAIR = RigGeometry(
    ("left", "right"), 0, (CAMERA, CAMERA),
    (Pose.identity(), Pose(np.eye(3), np.array([-60.0, 0.0, 0.0]))),
)  # fmt: skip


def seen(view: int, xy_px: np.ndarray) -> Sighting:
    return Sighting(0, view, np.arange(20, dtype=np.intp), xy_px, np.full(20, 0.02))


def test_a_drift_is_measured_with_the_centres_of_circles():
    sightings = [seen(0, LEFT.middles()), seen(1, RIGHT.middles())]
    assert np.abs(LEFT.middles() - LEFT.centres()).max() > 0.1
    left, right = geometry_drift._of_centres(sightings, PAIR, POINTS_MM, 20.0)
    assert left.xy_px == pytest.approx(LEFT.centres(), abs=2e-3)
    assert right.xy_px == pytest.approx(RIGHT.centres(), abs=2e-3)


def test_circles_where_the_lens_shows_nothing_are_told():
    folded = CameraModel(480, 320, 60.0, 60.0, 239.5, 159.5, "brown5", (-0.6, 0.0, 0.0, 0.0, 0.0))
    geometry = RigGeometry(("left",), 0, (folded,), (Pose.identity(),))
    far = np.column_stack([np.linspace(0, 40, 20), np.linspace(0, 30, 20) ** 1.1])
    with pytest.raises(TargetError, match="lens shows nothing"):
        geometry_drift._of_centres([seen(0, far)], geometry, POINTS_MM, 20.0)


def test_a_target_without_squares_skips_what_measures_them():
    profile = parse_profile(
        {
            "name": "pair",
            "pitch_mm": 60.0,
            "views": [
                {"name": "left", "x_steps": 0.0, "y_steps": 0.0},
                {"name": "right", "x_steps": 1.0, "y_steps": 0.0},
            ],
            "camera": {
                "kind": "folder", "folder": "/", "files": {"left": "l*.png", "right": "r*.png"},
            },
            "slopes": {"range_px": [0.0, 40.0]},
            "target": {
                "kind": "asymmetric_circles", "columns": 4, "rows": 5, "spacing_mm": 24.0,
                "diameter_mm": 20.0,
            },
        },
        source="test",
    )  # fmt: skip
    rng = np.random.default_rng(1)
    frames = [
        Frame(name, rng.integers(90, 110, (64, 80)).astype(np.uint8), 0.0, 0)
        for name in ("left", "right")
    ]
    items = {
        item.name: item
        for item in judge_scene(profile, {}, [MultiView(tuple(frames))] * 3, at_mm=None)
    }
    assert items["board"].status == "skip"
    assert items["board"].found == (
        "a target of kind asymmetric_circles has no squares: it is for rig calibrate"
    )
