"""Stored pictures in place of a camera: folders, patterns, videos."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from rig_drivers.stored.folder import FolderCamera

from rig.calibrate.stored_pictures import stored_pictures
from rig.devices import SystemClock
from rig.errors import ConfigError, DeviceLostError
from rig.profile import FolderCameraConfig, PartConfig, Profile
from rig.profile.load import load_profile


def a_pair() -> Profile:
    return load_profile("checkerboard-stereo")


def camera_of(profile: Profile) -> FolderCamera:
    assert isinstance(profile.camera, FolderCameraConfig)
    folder = Path(profile.camera.folder)
    return FolderCamera(profile.camera, profile.views, root=folder, clock=SystemClock())


def write_video(path: Path, levels: list[int]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    for level in levels:
        writer.write(np.full((48, 64, 3), level, np.uint8))
    writer.release()


@pytest.mark.parametrize(
    "layout", ["{view}{n}.png", "{view}/{n}.png", "{n}/{view}.png"], ids=["names", "view", "number"]
)
def test_a_folder_tells_its_views_in_any_usual_layout(tmp_path: Path, layout: str):
    for view, level in (("left", 10), ("right", 60)):
        for n in range(3):
            file = tmp_path / layout.format(view=view, n=n)
            file.parent.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(file), np.full((48, 64), level + n, np.uint8))
    with camera_of(stored_pictures(a_pair(), [str(tmp_path)], Path.cwd())) as camera:
        seen = [[int(f.image[0, 0]) for f in m.frames] for m in camera.stream()]
    assert seen == [[10, 60], [11, 61], [12, 62]]


def test_videos_are_cameras_and_may_be_named_one_by_one(tmp_path: Path):
    write_video(tmp_path / "a.avi", [10, 60, 120])
    write_video(tmp_path / "sub" / "b.avi", [200, 150, 100])
    given = ["left=a.avi", f"right={tmp_path / 'sub' / 'b.avi'}"]
    with camera_of(stored_pictures(a_pair(), given, tmp_path)) as camera:
        seen = [[int(np.median(f.image)) for f in m.frames] for m in camera.stream()]
    assert np.abs(np.array(seen) - [[10, 200], [60, 150], [120, 100]]).max() <= 3


def test_a_damaged_video_is_named(tmp_path: Path):
    for name in ("left.mp4", "right.mp4"):
        (tmp_path / name).write_bytes(b"no video at all")
    camera = camera_of(stored_pictures(a_pair(), [str(tmp_path)], Path.cwd()))
    with pytest.raises(DeviceLostError, match=r"left\.mp4 is no video"):
        camera.__enter__()


@pytest.mark.parametrize(
    ("given", "match"),
    [
        (["nowhere"], "no such folder"),
        (["left=a.avi"], "give one VIEW=PATTERN for each of left, right"),
        (["left=a.avi", "right"], "write VIEW=PATTERN"),
        (["."], "nothing for view left"),
    ],
)
def test_frames_that_cannot_be_used_are_refused(tmp_path: Path, given: list[str], match: str):
    given = [str(tmp_path) if one == "." else one for one in given]
    with pytest.raises(ConfigError, match=match):
        stored_pictures(a_pair(), given, tmp_path)


def test_views_of_the_same_pictures_are_the_parts_that_the_profile_says(tmp_path: Path):
    both = np.hstack([np.full((48, 64), level, np.uint8) for level in (10, 60)])
    cv2.imwrite(str(tmp_path / "pair_1.png"), both)
    given = ["left=pair_*.png", "right=pair_*.png"]
    parts = {
        "left": PartConfig(layout="side-by-side", place=2),
        "right": PartConfig(layout="side-by-side", place=1),
    }
    bench = a_pair()
    own = bench.camera.model_copy(update={"parts": parts})
    with camera_of(
        stored_pictures(bench.model_copy(update={"camera": own}), given, tmp_path)
    ) as camera:
        assert [[int(f.image[0, 0]) for f in m.frames] for m in camera.stream()] == [[60, 10]]
    told = "--frames names the same pictures for left, right, .* where in them left, right lies"
    with pytest.raises(ConfigError, match=told):
        stored_pictures(bench, given, tmp_path)
