"""Chances of a drift: noise that parts of the picture, and views, have in common."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar.scene.chances import Evidence, chance, hypotheses
from rig.epipolar.scene.drift import scene_drift
from rig.epipolar.scene.look import axes_of
from tests.support.scene_features import features_of, row_of

PAIR = row_of((0.3, -0.2, 0.4))
TRIPLE = row_of((0.3, -0.2, 0.4), (-0.1, 0.25, -0.3))
SURE = np.diag(
    np.array([*3 * [0.05, 0.05, 1e-4, 1e-4], *2 * [*3 * [1e-7], *3 * [1e-4]]], np.float64) ** 2
)


def test_noise_is_what_parts_pull_beyond_what_independent_ones_would():
    # Independent pulls towards two turns, of 400 parts with information 4 and 9 between them.
    random = np.random.default_rng(1)
    information = np.diag([4.0, 9.0])
    pulls = random.standard_normal((400, 2)) * np.sqrt(np.diag(information) / 400.0)
    evidence = Evidence(information, np.zeros(2), pulls, 1.0, 100)
    both = np.eye(2)
    assert evidence.noise_of(both, 1.0) == pytest.approx(1.0, abs=0.15)
    thrice = replace(evidence, parts=3.0 * pulls)
    assert thrice.noise_of(both, 1.0) == pytest.approx(9.0 * evidence.noise_of(both, 1.0))
    # Turns known worse than to 1 / sqrt(5) rad are not told: here the first one.
    first = replace(evidence, parts=pulls * [100.0, 1.0])
    assert first.noise_of(both, 5.0**-0.5) < 1.5
    assert first.noise_of(both[:, :1], 0.1) == 1.0


def test_a_pull_of_many_sigmas_is_no_chance_and_one_that_is_not_told_is():
    assert chance(np.diag([4.0]), np.array([2.0]), 10**6, 1.0) == (
        pytest.approx(0.3173, abs=1e-3),
        1,
    )
    assert chance(np.diag([4.0]), np.array([12.0]), 10**6, 1.0)[0] < 1e-8
    assert chance(np.diag([0.1]), np.array([12.0]), 10**6, 1.0) == (1.0, 0)


def test_of_a_pair_nobody_tells_which_view_turned():
    assert list(hypotheses(PAIR, axes_of(PAIR))) == [None]
    assert set(hypotheses(TRIPLE, axes_of(TRIPLE))) == {0, 1, 2}


@pytest.mark.slow
def test_errors_of_the_reference_are_no_turn_of_it():
    probabilities: list[float] = []
    for seed in range(24):
        features = features_of(TRIPLE, seed, 360, noise_px=0.05)
        random = np.random.default_rng(1000 + seed)
        # Neighbours of the reference err together: parts of the picture as large as those judged.
        part = (features.reference_px * 6 / [640, 480]).astype(int)
        error_px = 0.08 * random.standard_normal((6, 6, 2))[part[:, 1], part[:, 0]]
        moved = replace(features, reference_px=features.reference_px + error_px)
        probabilities.append(scene_drift(TRIPLE, SURE, moved).probability)
    assert min(probabilities) > 1e-4
    assert np.mean(probabilities) > 0.3
