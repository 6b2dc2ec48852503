"""One camera alone: its profile, what is refused, and from pictures to exported files."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from rig.errors import ConfigError
from rig.optics.target import target_of
from rig.profile import Profile
from rig.profile.load import load_profile
from rig.profile.template import Recipe, profile_text
from rig.stored import optics_of
from rig.sweep.request import sweep_setup
from rig.targets.checkerboard import Checkerboard
from tests.support.board_images import BoardScene, digitised
from tests.support.command import Command

PROFILE = """\
name = "webcam"
[[views]]
name = "eye"
[camera]
kind = "folder"
folder = {folder}
[camera.files]
eye = "*.png"
[target]
kind = "checkerboard"
columns = 8
rows = 5
square_mm = 30.0
"""
FOCAL_PX = 420.0
POSES = [
    ((-90, -60, 560), (25, 10, 3)), ((90, -60, 560), (-25, 15, -8)), ((-90, 60, 540), (10, -28, 5)),
    ((90, 60, 560), (-12, 30, 0)), ((0, 0, 380), (20, 20, 10)), ((0, 0, 800), (-30, 5, 90)),
    ((-60, 0, 430), (5, 32, -12)), ((60, 10, 450), (-20, -25, 20)), ((0, -40, 500), (35, 0, 0)),
    ((-100, -55, 470), (12, 12, 0)), ((100, -55, 470), (12, -12, 0)),
    ((-100, 55, 470), (-12, 12, 0)), ((100, 55, 470), (-12, -12, 0)),
]  # fmt: skip


def a_profile(folder: Path) -> Path:
    path = folder / "webcam.toml"
    path.write_text(PROFILE.format(folder=f'"{folder}"'))
    return path


def load(folder: Path, *overrides: str) -> Profile:
    return load_profile(str(a_profile(folder)), overrides)


def test_a_profile_of_one_view_has_no_steps_and_no_slopes(tmp_path: Path):
    profile = load(tmp_path)
    assert [view.name for view in profile.views] == ["eye"]
    assert profile.reference == 0
    assert profile.target is not None
    assert target_of(profile.target) == Checkerboard(8, 5, 30.0)


def test_two_views_must_still_say_their_pitch(tmp_path: Path):
    path = a_profile(tmp_path)
    path.write_text(path.read_text().replace("[camera]", '[[views]]\nname = "other"\n[camera]', 1))
    with pytest.raises(ConfigError, match="pitch_mm"):
        load_profile(str(path))


def test_what_takes_two_views_is_refused_in_one_line(tmp_path: Path):
    profile = load(tmp_path)
    with pytest.raises(ConfigError, match="a sweep needs two views or more, it has one"):
        sweep_setup(profile)
    with pytest.raises(ConfigError, match="depth needs two views or more") as told:
        optics_of(profile, None)
    assert "rig calibrate webcam" in str(told.value)


def test_a_new_profile_of_one_camera_loads(tmp_path: Path):
    path = tmp_path / "cam.toml"
    path.write_text(profile_text(Recipe("cam", "v4l2", 1, None, cameras=("/dev/video7",))))
    profile = load_profile(str(path))
    assert profile.camera.by_view["devices"] == {"camera": "/dev/video7"}
    assert profile.sweep is None
    with pytest.raises(ConfigError, match="one view with the stage grbl"):
        profile_text(Recipe("cam", "v4l2", 1, "grbl"))


@pytest.mark.slow
def test_pictures_of_one_camera_become_files_for_opencv_and_ros(rig: Command, tmp_path: Path):
    scene = BoardScene(
        columns=8, rows=5, square_mm=30.0, width=480, height=320, focal_px=FOCAL_PX, blur_px=0.8
    )
    rng = np.random.default_rng(5)
    for number, ((x, y, z), turned) in enumerate(POSES):
        pose = scene.with_changes(offset_mm=(x, y), distance_mm=float(z), tilt_deg=turned)
        picture = digitised(pose.clean(), noise=1.0, rng=rng)
        assert cv2.imwrite(str(tmp_path / f"{number:02d}.png"), picture)
    database = f"sqlite:///{tmp_path / 'rig.db'}"
    profile = a_profile(tmp_path)
    found = rig("calibrate", profile, "--lens", "brown5", "--db", database, "--json")
    assert found.json["depth_error"] == []
    assert found.json["epipolar_px"] is None
    assert 0.0 < found.json["direction_error_px"]["seen"] < 0.1
    assert found.code in (0, 3)  # whether every corner was reached is not the question here
    assert Path(found.json["report"]).read_text().count("How sure directions are") == 1
    rig("export", 1, "--format", "opencv", "--out", tmp_path / "cv", "--db", database)
    storage = cv2.FileStorage(str(tmp_path / "cv" / "camera.yml"), cv2.FILE_STORAGE_READ)
    matrix = storage.getNode("camera_matrix").mat()
    assert storage.getNode("image_width").real() == 480.0
    assert matrix[0, 0] == pytest.approx(FOCAL_PX, rel=2e-3)
    assert matrix[:2, 2] == pytest.approx([239.5, 159.5], abs=0.6)
    assert storage.getNode("distortion_coefficients").mat().shape == (5, 1)
    rig("export", 1, "--format", "ros", "--out", tmp_path / "ros", "--db", database)
    info = yaml.safe_load((tmp_path / "ros" / "eye.yaml").read_text())
    assert info["camera_matrix"]["data"] == pytest.approx(matrix.ravel().tolist())
    projection = np.array(info["projection_matrix"]["data"]).reshape(3, 4)
    assert projection[:, :3] == pytest.approx(matrix)
    assert projection[:, 3].tolist() == [0.0, 0.0, 0.0]
    assert info["rectification_matrix"]["data"] == np.eye(3).ravel().tolist()
    assert [path.name for path in (tmp_path / "ros").iterdir()] == ["eye.yaml"]
    refused = rig("capture", profile, "--frames", 1, "--db", database)
    assert refused.code == 1
    assert "needs two views or more" in refused.err
