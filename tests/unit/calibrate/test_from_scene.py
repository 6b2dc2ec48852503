"""`rig calibrate --from-scene`: from a folder of pictures to a calibration that says what it is."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.calibrate.from_scene import MOST_SCENES
from tests.support.command import Command
from tests.support.scene_pictures import cards, photographs, true_camera

PROFILE = """
name = "cards"
pitch_mm = 75.0
views = [
    {{ name = "left", x_steps = 0.0, y_steps = 0.0 }},
    {{ name = "right", x_steps = 1.0, y_steps = 0.0 }},
]
[camera]
kind = "folder"
folder = "{folder}"
files = {{ left = "left*.png", right = "right*.png" }}
[intrinsics]
focal_px = 260.0
[slopes]
range_px = [-10.0, 60.0]
"""


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    """A folder of plain pictures, and a profile of their rig."""
    for view in ("left", "right"):
        cv2.imwrite(str(tmp_path / f"{view}0.png"), np.full((120, 160), 90, np.uint8))
    file = tmp_path / "cards.toml"
    file.write_text(PROFILE.format(folder=tmp_path))
    return file


@pytest.fixture
def scenes(tmp_path: Path, profile: Path) -> Path:
    """The same profile with two scenes, the first of them twice."""
    cameras = [
        true_camera("left", (0.0, 0.0, 0.0), (0.4, 0.3, -0.2)),
        true_camera("right", (75.0, 0.0, 0.0), (-0.5, 0.2, 0.6)),
    ]
    for number, seed in enumerate((1, 1, 2)):
        for camera, image in zip(cameras, photographs(cameras, cards(seed), number), strict=True):
            cv2.imwrite(str(tmp_path / f"{camera.view}{number}.png"), image)
    return profile


@pytest.mark.slow
def test_a_scene_makes_a_calibration_that_says_where_it_is_from(rig: Command, scenes: Path):
    found = rig("calibrate", scenes, "--from-scene", "--note", "desk", "--json").json
    assert found["scenes"] == 2
    scene = found["from_scene"]
    assert scene["focal_from"] == "260.0 px as the profile states"
    assert scene["lengths"] == "by the profile's pitch_mm, not measured"
    assert scene["rows_px"]["right"]["smooth_rms"] < 0.05
    assert scene["rows_sigma_px"] < 0.3
    assert found["verdict"]["good"]
    assert json.loads(Path(found["file"]).read_text())["geometry"]["names"] == ["left", "right"]
    listed = rig("history")
    assert "from a scene, lengths by the pitch" in listed.out
    captured = rig("capture", scenes, "--slopes-only", "--frames", "1")
    assert captured.code == 0
    assert "calibration 1 is from a scene; lengths by the profile's pitch" in captured.err
    assert "rows do not meet" not in captured.err


@pytest.mark.parametrize("option", ["--stage", "--resume"])
def test_options_of_a_target_are_named(rig: Command, profile: Path, option: str):
    ended = rig("calibrate", profile, "--from-scene", option)
    assert ended.code == 2
    assert f"{option} with --from-scene" in ended.err


def test_lens_models_that_scenes_do_not_tell_are_named(rig: Command, profile: Path):
    ended = rig("calibrate", profile, "--from-scene", "--lens", "fisheye")
    assert ended.code == 2
    assert "--lens fisheye with --from-scene" in ended.err


def test_a_scene_without_texture_leaves_nothing_behind(rig: Command, tmp_path: Path, profile: Path):
    ended = rig("calibrate", profile, "--from-scene", "--pictures", str(MOST_SCENES + 1))
    assert ended.code == 1
    assert "shares 0 features" in ended.err
    assert not list(tmp_path.glob("bench/frames/cards/calibration_*"))
