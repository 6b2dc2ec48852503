"""The simplest lens that predicts unseen pictures as well as any."""

import numpy as np
import pytest

from rig.geometry.bundle.lens_choice import choose_lens, score_lenses, with_lens
from rig.geometry.bundle.unknowns import Unknowns
from rig.geometry.lens import LensModel, distort

RNG = np.random.default_rng(1)
PICTURES_PX2 = 0.01 * RNG.chisquare(100, 30) / 100


def scored(**worse: float | np.ndarray) -> LensModel:
    models: list[tuple[LensModel, np.ndarray]] = [
        ("brown5", PICTURES_PX2 + worse.get("brown5", 0.0)),
        ("fisheye", PICTURES_PX2 + worse.get("fisheye", 0.0)),
        ("brown8", PICTURES_PX2 + worse.get("brown8", 0.0)),
    ]
    return choose_lens(score_lenses(models))


@pytest.mark.parametrize(
    ("worse", "chosen"),
    [
        ({}, "brown5"),
        ({"brown5": 5e-5}, "brown5"),  # sure, but half a percent
        ({"brown5": 5e-4}, "fisheye"),
        ({"brown5": 5e-4, "fisheye": 5e-4}, "brown8"),
        ({"brown5": 5e-4 + 3e-3 * RNG.standard_normal(30)}, "brown5"),  # ten percent, by chance
        ({"fisheye": 1e-3, "brown8": 1e-3}, "brown5"),
    ],
)
def test_a_model_must_be_better_by_more_than_chance_and_a_trifle(
    worse: dict[str, float | np.ndarray], chosen: LensModel
):
    assert scored(**worse) == chosen


def test_pictures_without_a_score_do_not_count():
    gaps = np.where(np.arange(30) % 7, 0.0, np.nan)
    assert scored(brown5=gaps) == "brown5"


def test_a_simpler_lens_becomes_a_richer_one_that_shows_the_same():
    numbers = np.array([880.0, 884.0, 640.0, 400.0, -0.1, 0.03, 1e-3, -2e-3, 0.01])
    eye, none = np.eye(3)[None], np.zeros((1, 3))
    at = Unknowns(("brown5",), (numbers,), eye, none, np.zeros(3), eye, none)
    found = with_lens(at, "brown8", [(1280, 800)])
    assert found.lenses == ("brown8",)
    (richer,) = found.intrinsics
    xy = np.array([[0.3, 0.2], [-0.5, 0.4], [0.0, -0.3]])
    before = distort("brown5", numbers[4:], xy).xy * numbers[:2] + numbers[2:4]
    after = distort("brown8", richer[4:], xy).xy * richer[:2] + richer[2:4]
    assert after == pytest.approx(before, abs=1e-6)
