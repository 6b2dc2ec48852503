"""What is no set of rectified views is refused, with what was found and what to give."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from rig.epipolar import RectifiedViews, SlopePrior, estimate_slopes
from rig.errors import SlopeError
from tests.unit.epipolar.conftest import Scene

FRAMES = np.zeros((3, 20, 24), np.uint8)
ROW = np.array([-1.0, 0.0, 1.0])


def views(**changes: object) -> RectifiedViews:
    given = {"images": FRAMES, "x_steps": ROW, "y_steps": np.zeros(3), "reference": 1} | changes
    return RectifiedViews(**cast("dict[str, Any]", given))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"images": [FRAMES[0], FRAMES[0, :10], FRAMES[2]]}, r"10 x 24, 20 x 24.*rectify"),
        ({"images": FRAMES.astype(np.float64)}, r"\(3, 20, 24\) of float64"),
        ({"images": np.zeros((3, 20, 24, 4), np.uint8)}, r"\(3, 20, 24, 4\) of uint8.*colour"),
        ({"images": FRAMES[0]}, r"\(20, 24\) of uint8"),
        ({"images": FRAMES[:1]}, "found 1 views with 3 x and 3 y positions"),
        (
            {"images": FRAMES[:1], "x_steps": [0.0], "y_steps": [0.0], "reference": 0},
            "give two views or more",
        ),
        ({"x_steps": ROW[:2]}, "3 views with 2 x and 3 y positions"),
        ({"reference": 3}, r"reference view 3 asked for, views are 0\.\.2"),
        ({"x_steps": [np.nan, 0.0, 1.0]}, "finite"),
        ({"reference": 0}, r"lies at \(-1\.0, 0\.0\).*must be at \(0, 0\)"),
        ({"x_steps": np.zeros(3)}, "all views lie at one position"),
    ],
    ids=[
        "different-sizes",
        "float64",
        "four-channels",
        "one-image",
        "too-few-images",
        "one-view",
        "too-few-positions",
        "no-such-reference",
        "nan-position",
        "reference-off-centre",
        "one-position",
    ],
)
def test_what_is_no_set_of_views_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(SlopeError, match=message):
        views(**changes)


def test_lists_are_taken_as_arrays() -> None:
    assert views(images=list(FRAMES), x_steps=[-1, 0, 1]).images.shape == (3, 20, 24)


def test_a_negative_sigma_is_refused() -> None:
    mean = np.zeros((20, 24), np.float32)
    with pytest.raises(SlopeError, match="negative sigma"):
        estimate_slopes(views(), (-1.0, 1.0), SlopePrior(mean, mean - 1))


def test_dead_cameras_are_told_where_too_few_others_are_left(ball: Scene) -> None:
    images = ball.views.images.copy()
    images[[0, 2, 3, 4]] = 0
    with pytest.raises(SlopeError, match="only 1 of 5 views show anything"):
        estimate_slopes(replace(ball.views, images=images), ball.range_px)


def test_clipped_pixels_are_not_sure_of_themselves(ball: Scene) -> None:
    gains = np.array([1.05, 1.0, 0.96, 1.03, 0.98])[:, None, None]
    clipped = np.clip(ball.views.images * gains, 0, 140).astype(np.uint8)
    found = estimate_slopes(replace(ball.views, images=clipped), ball.range_px)
    burnt = clipped[1] == 140
    scaled = np.abs(found.slope_px - ball.slope_px) / found.sigma_px
    for part in (burnt, ~burnt):
        assert 1.4826 * np.nanmedian(scaled[part]) < 1.6
    assert np.nanmedian(found.sigma_px[burnt]) > 2 * np.nanmedian(found.sigma_px[~burnt])
