"""What is known before the scene is asked."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar.scene.prior import Sureness, prior_of, with_lens_terms
from tests.support.scene_features import row_of

SURE = Sureness(focal_pct=1.0, centre_px=3.0, turn_deg=2.0, length_pct=0.5, direction_deg=1.0)


def test_focal_lengths_err_together_and_a_little_apart():
    prior = prior_of(row_of((0.0, 0.0, 0.0), focal_px=(400.0, 500.0)), SURE)
    assert prior[0, 0] == pytest.approx(4.0**2 * 1.25 + 0.04**2)
    assert prior[0, 1] == pytest.approx(4.0**2 * 1.25)
    assert prior[0, 4] == pytest.approx(4.0 * 5.0)
    assert prior[4, 4] == pytest.approx(5.0**2 * 1.25 + 0.05**2)
    assert prior[2, 2] == prior[3, 3] == prior[6, 6] == 9.0
    assert prior[0, 2] == prior[2, 3] == 0.0


def test_baselines_are_surer_along_than_across():
    prior = prior_of(row_of((0.0, 0.0, 0.0)), SURE)
    assert np.diag(prior)[8:11] == pytest.approx([np.radians(2.0) ** 2] * 3)
    across_mm = 75.0 * np.radians(1.0)
    assert np.diag(prior)[11:14] == pytest.approx([0.375**2, across_mm**2, across_mm**2])


def test_a_start_with_a_covariance_keeps_it_for_its_lenses():
    rig = row_of((0.0, 0.0, 0.0))
    known = np.diag(np.arange(1.0, 15.0))
    prior = prior_of(replace(rig, covariance=known), SURE)
    assert np.diag(prior)[:8].tolist() == list(range(1, 9))
    assert prior[8, 8] == pytest.approx(np.radians(2.0) ** 2)


def test_lens_terms_are_freed_where_the_lens_had_none():
    rig = row_of((0.0, 0.0, 0.0))
    prior = prior_of(rig, SURE)
    freed, wider = with_lens_terms(rig, prior)
    assert [camera.lens for camera in freed.cameras] == ["brown5", "brown5"]
    terms = [0.05**2, 0.05**2, 2e-3**2, 2e-3**2, 0.02**2]
    assert np.diag(wider)[4:9] == pytest.approx(terms)
    assert np.diag(wider)[13:18] == pytest.approx(terms)
    assert wider[0, 9] == prior[0, 4]
    assert np.array_equal(wider[18:, 18:], prior[8:, 8:])


def test_lens_terms_are_freed_about_those_that_are_known():
    rig = row_of((0.0, 0.0, 0.0), coefficients=(0.1, 0.0, 0.0, 0.0, 0.0))
    prior = prior_of(rig, SURE)
    assert prior[4, 4] == 0.0
    freed, wider = with_lens_terms(rig, prior)
    assert freed.cameras == rig.cameras
    assert wider[4, 4] == pytest.approx(0.05**2)
