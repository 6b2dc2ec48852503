"""Read-out of rows from boards that move: a camera whose rows are late by a known time."""

from dataclasses import replace

import numpy as np
import pytest

from rig.arrays import Float
from rig.calibrate.sight import PictureSightings
from rig.calibrate.solve import readouts_of
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.bundle.rolling_shutter import Readout, measure_readouts, readout_text
from rig.geometry.sighting import Sighting
from rig.profile import Profile
from rig.profile.load import parse_profile
from tests.support.calibration_scene import (
    HEIGHT,
    WIDTH,
    BoardPose,
    Scene,
    TrueCamera,
    flat_board_mm,
)

COUNT, RATE_HZ = 36, 15.0
TIMES_S = {number: number / RATE_HZ for number in range(COUNT)}
CAMERA = TrueCamera((0.0, 0.0, 0.0))


def pose_at(time_s: float) -> BoardPose:
    """A board that swings through the picture, tilting as it goes."""
    a = 2 * np.pi * time_s
    return BoardPose(
        (110 * np.sin(0.7 * a), 70 * np.sin(0.9 * a + 1), 520 + 90 * np.sin(0.4 * a)),
        (28 * np.sin(0.5 * a), 30 * np.sin(0.6 * a + 2), 20 * np.sin(0.3 * a)),
    )


def shown(time_s: float) -> Float:
    return Scene((CAMERA,), (pose_at(time_s),)).shown(0, 0)


def late_rows(number: int, readout_s: float) -> Float:
    """Where every point is when its own row is read out."""
    now_s = TIMES_S[number]
    xy_px = shown(now_s)
    for _ in range(4):
        late = (xy_px[:, 1] - (HEIGHT - 1) / 2) / HEIGHT * readout_s
        xy_px = np.stack([shown(now_s + float(t))[n] for n, t in enumerate(late)])
    return xy_px


def calibrated(readout_s: float, noise_px: float = 0.03) -> Calibration:
    rng = np.random.default_rng(6)
    ids = np.arange(len(flat_board_mm()), dtype=np.intp)
    seen = [
        Sighting(
            number, 0, ids,
            (late_rows(number, readout_s) if readout_s else shown(TIMES_S[number]))
            + noise_px * rng.standard_normal((len(ids), 2)),
            np.full(len(ids), noise_px),
        )
        for number in range(COUNT)
    ]  # fmt: skip
    return solve_rig(seen, flat_board_mm(), [(WIDTH, HEIGHT)], ("eye",), 0, lens="none")


@pytest.fixture(scope="module")
def at_once() -> Calibration:
    return calibrated(0.0)


def test_rows_that_come_at_once_are_not_called_rolling(at_once: Calibration):
    (readout,) = measure_readouts(at_once, TIMES_S)
    assert abs(readout.readout_s) < 4 * readout.sigma_s
    assert 0 < readout.sigma_s < 1e-3
    assert not readout.is_rolling


@pytest.mark.slow
@pytest.mark.parametrize("readout_s", [0.016, -0.008])
def test_late_rows_are_told_with_their_time(readout_s: float):
    found = calibrated(readout_s)
    (readout,) = measure_readouts(found, TIMES_S)
    assert readout.readout_s == pytest.approx(readout_s, rel=0.1)
    assert readout.is_rolling
    text = readout_text(found, readout)
    assert f"rows out in {1e3 * readout.readout_s:.1f} +- " in text
    assert "eye has a rolling shutter" in text


def test_pictures_far_apart_or_without_times_tell_nothing(at_once: Calibration):
    slow = {number: 10 * time_s for number, time_s in TIMES_S.items()}
    assert measure_readouts(at_once, slow) == ()
    assert measure_readouts(at_once, {}) == ()
    few = {number: TIMES_S[number] for number in range(6)}
    assert measure_readouts(at_once, few) == ()


def test_what_it_means_for_depth_is_told_in_per_cent(at_once: Calibration):
    readout = Readout(0, 0.020, 0.0001, 350.0, 0.42)
    assert readout.is_rolling
    assert not replace(readout, sigma_s=0.0041).is_rolling
    text = readout_text(at_once, readout)
    assert "in 20.0 +- 0.2 ms (k=2)" in text
    assert "up to 350 px/s were bent by 0.42 px" in text
    assert "views above each other is off by 0.25 %" in text  # 100 px/s x 20 ms / 800 rows


def test_only_times_of_exposure_count(at_once: Calibration):
    pictures = [
        PictureSightings(number, None, ((WIDTH, HEIGHT),), (), time_s=time_s)
        for number, time_s in TIMES_S.items()
    ]

    def profile(camera: dict[str, object]) -> Profile:
        data = {"name": "eye", "views": [{"name": "eye"}], "camera": camera}
        return parse_profile(data, source="test")

    recorded = profile({"kind": "recording", "file": "eye.mcap"})
    assert readouts_of(recorded, pictures, at_once) == measure_readouts(at_once, TIMES_S)
    assert len(readouts_of(recorded, pictures, at_once)) == 1
    folder = profile({"kind": "folder", "folder": "/", "files": {"eye": "*.png"}})
    assert readouts_of(folder, pictures, at_once) == ()
