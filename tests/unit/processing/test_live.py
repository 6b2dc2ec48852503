"""Processing as a capture does it: by the profile, on the frames of a live camera."""

import json
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.capture.capture import CaptureRequest, capture_depth
from rig.epipolar import Label
from rig.errors import ConfigError
from rig.geometry.pinhole import Pinhole
from rig.live.captured import read_capture
from rig.live.frame import DepthFrame
from rig.live.opening import open_depth_camera
from rig.testing.simulated import PROFILE, open_simulated_rig
from tests.support.command import Command


def frames(count: int, overrides: Sequence[str] = ()) -> list[DepthFrame]:
    with open_simulated_rig(overrides) as camera:
        return [frame for frame, _ in zip(camera, range(count), strict=False)]


@pytest.fixture(scope="module")
def plain() -> list[DepthFrame]:
    return frames(3)


def test_nothing_is_done_by_default(plain: list[DepthFrame]):
    for frame in plain:
        assert frame.depth_mm.shape == (100, 160)
        assert (frame.label < Label.FILLED).all()


def test_a_region_has_maps_a_picture_and_a_camera_of_its_own(plain: list[DepthFrame]):
    (frame,) = frames(1, ["processing.roi_px=[60, 30, 48, 40]"])
    assert frame.depth_mm.shape == frame.slopes.slope_px.shape == frame.label.shape == (40, 48)
    assert (frame.image == plain[0].image[30:70, 60:108]).all()
    part = np.s_[30:70, 60:108]
    both = np.isfinite(frame.depth_mm) & np.isfinite(plain[0].depth_mm[part])
    assert both.mean() > 0.9
    away_mm = (frame.points_mm() - plain[0].points_mm()[part])[both]
    assert np.abs(np.median(away_mm, axis=0)).max() < 1.0
    assert frame.valid_share == pytest.approx(np.mean(frame.label > 0))


def test_a_decimated_frame_shows_the_same_points(plain: list[DepthFrame]):
    (frame,) = frames(1, ["processing.decimation=2"])
    assert frame.depth_mm.shape == frame.image.shape == frame.label.shape == (50, 80)
    assert frame.camera.matrix[0, 0] == plain[0].camera.matrix[0, 0] / 2
    squares = plain[0].points_mm().reshape(50, 2, 80, 2, 3)
    known = np.isfinite(squares).all(axis=(1, 3, 4)) & (np.ptp(squares[..., 2], (1, 3)) < 5.0)
    away_mm = (frame.points_mm() - squares.mean(axis=(1, 3)))[known]
    assert known.mean() > 0.3
    assert np.abs(away_mm).max() < 5.0
    assert np.abs(np.median(away_mm, axis=0)).max() < 0.5


def test_filled_pixels_are_those_without_an_answer_and_within_the_limit(plain: list[DepthFrame]):
    (frame,) = frames(1, ["processing.fill_px=10"])
    before = plain[0]
    answered = before.label > 0
    assert np.array_equal(frame.depth_mm[answered], before.depth_mm[answered])
    assert np.array_equal(frame.sigma_mm[answered], before.sigma_mm[answered])
    assert (frame.label[answered] == before.label[answered]).all()
    filled = frame.label == Label.FILLED
    assert filled.sum() > 0
    assert not (filled & answered).any()
    assert (frame.sigma_mm[filled] <= 0.01 * frame.depth_mm[filled]).all()


def test_the_temporal_filter_lowers_sigma_and_the_error():
    first, *_, last = frames(8, ["processing.temporal_frames=8"])
    board = np.s_[40:60, 60:100]
    assert np.nanmedian(last.sigma_mm[board]) < 0.8 * np.nanmedian(first.sigma_mm[board])
    spread = [float(np.nanstd(frame.depth_mm[board])) for frame in (first, last)]
    assert spread[1] < 0.95 * spread[0]  # most of it is the same in every frame


def test_a_grab_is_not_averaged_with_what_was_before(plain: list[DepthFrame]):
    with open_simulated_rig(["processing.temporal_frames=8"]) as camera:
        averaged = [camera.grab() for _ in range(2)]
    with open_simulated_rig() as camera:
        alone = [camera.grab() for _ in range(2)]
    for one, other in zip(averaged, alone, strict=True):
        assert np.array_equal(one.depth_mm, other.depth_mm, equal_nan=True)


def test_slopes_alone_are_processed_as_well():
    with open_depth_camera(
        PROFILE,
        curve="none",
        calibration="none",
        overrides=["processing.roi_px=[60, 30, 48, 40]", "processing.decimation=2"],
    ) as camera:
        frame = camera.grab()
    assert frame.depth is None
    assert frame.pinhole is None
    assert frame.slopes.slope_px.shape == frame.image.shape == (20, 24)


def test_a_region_beside_the_maps_is_refused():
    with pytest.raises(ConfigError, match=r"the maps are of 160 x 100 px; choose processing\.roi"):
        frames(1, ["processing.roi_px=[120, 0, 48, 40]"])


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("processing.temporal_frames=1", "averages nothing"),
        ("processing.decimation=0", "decimation"),
        ("processing.roi_px=[0, 0, 7, 40]", "roi_px"),
        ("processing.roi_px=[0, 0, 40]", "roi_px"),
        ("processing.fill_px=-1", "fill_px"),
    ],
)
def test_a_profile_that_makes_no_sense_is_refused(override: str, says: str):
    with pytest.raises(ConfigError, match=says):
        open_simulated_rig([override])


def test_the_camera_of_a_part_sees_the_same_rays():
    whole = Pinhole(160, 100, 150.0, (79.5, 49.5), np.eye(3))
    points = whole.points_mm(np.full((100, 160), 500.0, np.float32))
    cut = whole.cut(20, 10, (60, 40))
    assert cut.points_mm(np.full((40, 60), 500.0, np.float32)) == pytest.approx(
        points[10:50, 20:80]
    )
    fewer = whole.decimated(3)
    assert (fewer.width_px, fewer.height_px, fewer.focal_px) == (53, 33, 50.0)
    assert fewer.points_mm(np.full((33, 53), 500.0, np.float32)) == pytest.approx(
        points[1:99:3, 1:159:3]  # the middle pixel of every square
    )


def test_options_of_capture_are_written_down_and_read_back(tmp_path: Path):
    overrides = [
        "processing.temporal_frames=4",
        "processing.roi_px=[60, 30, 48, 40]",
        "processing.fill_px=6",
        "processing.decimation=2",
    ]
    request = CaptureRequest(frames=2, duration_s=None, folder=tmp_path)
    with open_simulated_rig(overrides) as camera:
        capture_depth(camera, request, lambda *_: None)
    captured = list(read_capture(tmp_path))
    for frame in captured:
        assert frame.facts["processing"] == {
            "temporal_frames": 4,
            "roi_px": [60, 30, 48, 40],
            "fill_px": 6,
            "decimation": 2,
        }
        assert frame.depth_mm.shape == frame.label.shape == (20, 24)
        assert frame.image is not None
        assert frame.image.shape == (20, 24)
        assert frame.points_mm().shape == (20, 24, 3)
        assert ((frame.label > 0) == np.isfinite(frame.depth_mm)).all()
    png = cv2.imread(str(tmp_path / "label_00000.png"), cv2.IMREAD_UNCHANGED)
    assert np.asarray(png).max() <= Label.FILLED


def test_the_command_line_has_an_option_for_each(rig: Command, tmp_path: Path):
    answer = rig(
        "capture", PROFILE, "--slopes-only", "--frames", 1, "--out", tmp_path, "--json",
        "--roi", "60,30,48,40", "--temporal", 3, "--fill", 5, "--decimate", 2,
        "--set", "quality.valid_share_pct=0",
    )  # fmt: skip
    assert answer.code == 0, answer.err
    (line,) = (tmp_path / "frames.jsonl").read_text().splitlines()
    assert json.loads(line)["processing"] == {
        "temporal_frames": 3,
        "roi_px": [60, 30, 48, 40],
        "fill_px": 5,
        "decimation": 2,
    }


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--roi", "1,2,3"), ("--roi", "a,b,c,d"), ("--temporal", "1"), ("--decimate", "1"),
        ("--fill", "0"),
    ],
)  # fmt: skip
def test_options_that_mean_nothing_are_usage_errors(rig: Command, option: str, value: str):
    answer = rig("capture", PROFILE, "--slopes-only", "--frames", 1, option, value)
    assert answer.code == 2
    assert option in answer.err
