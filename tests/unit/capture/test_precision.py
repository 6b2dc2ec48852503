"""What a capture says of its median pixel."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rig.capture.precision import SURE_PX, Precision
from rig.cli.capture_precision import precision_as_dict, precision_in_words
from rig.depth import DepthMap
from rig.epipolar import SlopeMap
from rig.testing.simulated import PROFILE, open_simulated_rig
from tests.support.command import Command


@pytest.fixture(scope="module")
def frame() -> Any:
    with open_simulated_rig() as camera:
        return camera.grab()


def with_sigmas(frame: Any, *sigmas_mm: float) -> Any:
    values = np.array([sigmas_mm], np.float32)
    label = np.isfinite(values).astype(np.uint8)
    return replace(frame, depth=DepthMap(values, values, label))


def with_slopes(frame: Any, *sigmas_px: float) -> Any:
    values = np.array([sigmas_px], np.float32)
    slopes = SlopeMap(values, values, np.isfinite(values).astype(np.uint8))
    return replace(frame, slopes=slopes, depth=None)


NONE = float("nan")


def test_the_median_is_of_the_answered_pixels_and_its_mean_over_the_frames(frame: Any):
    precision = Precision()
    assert precision.median_k2 is None
    precision.add(with_sigmas(frame, NONE, 1.0, 2.0, 9.0))
    assert precision.median_k2 == pytest.approx(4.0)
    precision.add(with_sigmas(frame, 5.0, 5.0, 5.0))
    assert precision.median_k2 == pytest.approx(2.0 * 3.5)
    precision.add(with_sigmas(frame, NONE, NONE))  # no answer: nothing to be sure of
    assert precision.median_k2 == pytest.approx(2.0 * 3.5)


def test_sure_slopes_are_counted_among_all_pixels(frame: Any):
    precision = Precision()
    assert precision.sure_pct(0) is None
    precision.add(with_slopes(frame, NONE, 0.05, SURE_PX, 0.3))
    assert precision.sure_pct(1) == pytest.approx(25.0)
    assert precision.median_k2 == pytest.approx(2.0 * 0.1)
    precision.add(with_slopes(frame, 0.05, 0.05))
    assert precision.sure_pct(2) == pytest.approx(62.5)


def summary(**values: object) -> Any:
    plain = {
        "valid_mm": (400.0, 2500.0),
        "median_k2": 1.84,
        "sure_pct": 81.26,
        "board_rms_mm": None,
    }
    return SimpleNamespace(**{**plain, **values})


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({}, "valid 0.40-2.50 m, one pixel (median) +-1.8 mm, k=2"),
        (
            {"board_rms_mm": 0.041},
            "valid 0.40-2.50 m, one pixel (median) +-1.8 mm, k=2; board plane in its sweep "
            "0.041 mm rms at held-out distances",
        ),
        ({"median_k2": 12.3}, "valid 0.40-2.50 m, one pixel (median) +-12 mm, k=2"),
        ({"median_k2": None}, "valid 0.40-2.50 m, no pixel has an answer"),
        (
            {"valid_mm": None, "median_k2": 0.036},
            "81.3 % of the slopes surer than 0.1 px per view step (1 sigma); one pixel (median) "
            "+-0.036 px, k=2",
        ),
        ({"valid_mm": None, "median_k2": None}, "no slope has an answer"),
    ],
)
def test_precision_is_told_in_words(values: dict[str, object], says: str):
    assert precision_in_words(summary(**values)) == says


def test_programs_get_depth_or_slopes():
    assert precision_as_dict(summary(board_rms_mm=0.04)) == {
        "median_k2_mm": 1.84,
        "valid_mm": [400.0, 2500.0],
        "board_plane_rms_mm": 0.04,
    }
    assert precision_as_dict(summary(valid_mm=None)) == {
        "median_k2_px": 1.84,
        "sure_pct": 81.26,
        "sure_below_px": 0.1,
    }


def test_a_capture_of_slopes_says_how_many_are_sure(rig: Command, tmp_path: Path):
    answer = rig(
        "capture", PROFILE, "--slopes-only", "--frames", 1, "--out", tmp_path, "--json",
        "--set", "quality.valid_share_pct=0",
    )  # fmt: skip
    assert answer.code == 0, answer.err
    assert 0.0 < answer.json["sure_pct"] <= 100.0
    assert answer.json["sure_below_px"] == SURE_PX
    assert 0.0 < answer.json["median_k2_px"] < 1.0
    assert "median_k2_mm" not in answer.json
