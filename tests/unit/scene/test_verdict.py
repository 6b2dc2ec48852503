"""Whether scenes have told enough: every reason, from features in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.found import FoundGeometry, RowField, row_fields
from rig.epipolar.scene.prior import Sureness, prior_of
from rig.epipolar.scene.solve import fit_scene
from rig.epipolar.scene.verdict import empty_share, judge_scene, rows_sigma_of, spans_px
from tests.support.scene_features import features_of, row_of

SURE = Sureness(focal_pct=0.5, centre_px=2.0, turn_deg=2.0, length_pct=0.5, direction_deg=2.0)
PAIR = row_of((0.3, -0.2, 0.4))


def found_of(features: SceneFeatures) -> FoundGeometry:
    fit = fit_scene(PAIR, prior_of(PAIR, SURE), features)
    return FoundGeometry(fit, features, row_fields(fit, features), None)


def codes(found: FoundGeometry) -> set[str]:
    return {reason.code for reason in judge_scene(found, "a data sheet").reasons}


@pytest.fixture(scope="module")
def good() -> FoundGeometry:
    return found_of(features_of(PAIR, 1, 300, noise_px=0.1))


def test_scenes_that_tell_enough_are_good(good: FoundGeometry):
    verdict = judge_scene(good, "a data sheet")
    assert verdict.good
    assert str(verdict) == "good"
    assert verdict.notes == (
        "lengths by the profile's pitch_mm, not measured: depth is as true as that and as the "
        "focal length (a data sheet)",
    )


def test_freed_lenses_are_told(good: FoundGeometry):
    before = (None, RowField(0.31, 0.4, 0.2, is_sure=True))
    notes = judge_scene(replace(good, before=before), "a data sheet").notes
    assert "left a smooth 0.31 px rms across the lines: lens terms were found as well" in notes[1]


def test_few_features_are_told():
    verdict = judge_scene(found_of(features_of(PAIR, 2, 60, noise_px=0.1)), "")
    assert "few-features" in {reason.code for reason in verdict.reasons}
    assert "right: 60 features fit, 120 wanted" in str(verdict)


def test_features_in_one_part_are_told():
    features = features_of(PAIR, 3, 1500, noise_px=0.1)
    corner = features[(features.reference_px[:, 0] < 250.0) & (features.reference_px[:, 1] < 200.0)]
    assert "one-part" in codes(found_of(corner))


def test_features_at_one_distance_are_told():
    flat = features_of(PAIR, 4, 300, depths_mm=(2000.0, 2100.0), noise_px=0.1)
    assert "one-distance" in codes(found_of(flat))


def test_wrong_matches_are_told():
    mostly = features_of(PAIR, 5, 400, wrong=0.45, noise_px=0.1)
    assert "matches" in codes(found_of(mostly))


def test_noise_makes_rows_unsure():
    noisy = found_of(features_of(PAIR, 6, 150, noise_px=4.0))
    assert rows_sigma_of(noisy) > 0.3
    assert codes(noisy) == {"rows"}


def test_a_smooth_misfit_is_told(good: FoundGeometry):
    bent = replace(good, fields=(None, RowField(0.12, 0.2, 0.1, is_sure=True)))
    assert codes(bent) == {"model"}
    assert not codes(replace(good, fields=(None, RowField(0.09, 0.2, 0.1, is_sure=True))))
    assert not codes(replace(good, fields=(None, RowField(0.12, 0.2, 0.1, is_sure=False))))


def test_cells_without_features_are_counted():
    places = np.array([[10.0, 10.0], [20.0, 10.0], [630.0, 470.0], [639.0, 479.0], [300.0, 10.0]])
    assert empty_share(places, (640, 480)) == 14 / 16
    assert empty_share(np.zeros((0, 2)), (640, 480)) == 1.0


def test_shifts_span_from_far_to_near():
    exact = found_of(features_of(PAIR, 7, 400, depths_mm=(1000.0, 3000.0)))
    everything = np.ones(400, np.bool_)
    # 90 % of 450 px x 75 mm x (1 / 1000 mm - 1 / 3000 mm)
    assert spans_px(exact, 1, everything) == pytest.approx(0.9 * 22.5, rel=0.06)
    assert spans_px(exact, 1, ~everything) == 0.0
