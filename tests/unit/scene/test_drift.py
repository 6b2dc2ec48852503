"""Whether views have turned since a calibration: against closed form, noise and chance."""

from dataclasses import replace

import numpy as np
import pytest

from rig.arrays import Float
from rig.epipolar.scene.chances import least_chance
from rig.epipolar.scene.drift import SceneDrift, scene_drift
from rig.epipolar.scene.look import look
from rig.epipolar.scene.numbers import numbers_of, with_numbers
from rig.errors import CalibrationError
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from tests.support.scene_features import features_of, row_of

RIG = row_of((0.3, -0.2, 0.4))
SURE = np.diag(
    np.array([*2 * [0.05, 0.05, 2e-3, 2e-3], *3 * [np.radians(3e-4)], *3 * [0.003]], np.float64)
    ** 2
)


def turned(*turn_deg: float) -> RigGeometry:
    """The rig whose right view has turned about its own axes."""
    place = RIG.cam_from_reference[1]
    turn = Pose.from_vectors(np.radians(turn_deg), np.zeros(3)).rotation
    return replace(
        RIG,
        cam_from_reference=(
            Pose.identity(),
            Pose(turn @ place.rotation, place.translation_mm),
        ),
    )


def drift_of(true: RigGeometry, seed: int = 1, count: int = 500) -> SceneDrift:
    return scene_drift(RIG, SURE, features_of(true, seed, count, noise_px=0.15))


def test_a_rig_as_it_was_has_not_turned():
    drift = drift_of(RIG)
    assert drift.probability > 0.01
    assert drift.freedoms == 3
    assert drift.features > 480
    assert drift.turned_deg[0].tolist() == drift.sigma_deg[0].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("axis", [0, 2], ids=["pitch", "roll"])
def test_two_hundredths_of_a_degree_are_found(axis: int):
    turn = np.zeros(3)
    turn[axis] = 0.02
    drift = drift_of(turned(*turn.tolist()))
    assert drift.probability < 1e-6
    sigma = drift.sigma_deg[1, axis]
    assert sigma < 0.005
    assert drift.turned_deg[1, axis] == pytest.approx(0.02, abs=3.0 * sigma)
    assert abs(drift.turned_deg[1, 2 - axis]) < 4.0 * drift.sigma_deg[1, 2 - axis]


def test_rows_that_moved_by_a_twentieth_of_a_pixel_are_found():
    # At infinity a pitch of theta moves rows by f theta in the middle of the picture.
    drift = drift_of(turned(float(np.degrees(0.05 / 450.0)), 0.0, 0.0))
    assert drift.probability < 1e-4
    assert drift.rows_px == pytest.approx(0.05, abs=0.02)


def test_the_change_of_depth_is_an_interval_that_holds_it():
    drift = drift_of(turned(0.1, 0.05, 0.0))
    # A turn of theta moves points by f theta along the row, f b / Z is 33.75 px.
    off_pct = 100.0 * 450.0 * np.radians(0.05) / 33.75
    low, high = drift.depth_pct
    assert high - low > 0.2
    assert min(abs(low), abs(high)) < off_pct < max(abs(low), abs(high))
    assert low < 0.5 * (low + high) < high


def test_what_the_calibration_does_not_know_is_no_drift():
    loose = SURE.copy()
    loose[8, 8] = np.radians(0.1) ** 2
    features = features_of(turned(0.05, 0.0, 0.0), 2, 500, noise_px=0.15)
    assert scene_drift(RIG, SURE, features).probability < 1e-6
    assert scene_drift(RIG, loose, features).probability > 0.01


def test_long_looks_at_one_scene_do_not_make_it_surer():
    one = features_of(RIG, 3, 200, noise_px=0.15)
    often = type(one).joined([one] * 10)
    once, many = scene_drift(RIG, SURE, one), scene_drift(RIG, SURE, often)
    assert many.sigma_deg[1, 0] > 0.6 * once.sigma_deg[1, 0]
    assert many.probability > 1e-4


@pytest.mark.slow
def test_false_alarms_are_as_rare_as_told():
    probabilities: list[float] = []
    for seed in range(60):
        random = np.random.default_rng(seed)
        away: Float = np.sqrt(np.diag(SURE)) * random.standard_normal(14)
        away[[1, 5]] = away[[0, 4]]
        true = with_numbers(RIG, numbers_of(RIG) + away)
        probabilities.append(drift_of(true, 100 + seed, 200).probability)
    assert min(probabilities) > 1e-3
    assert 0.3 < np.mean(probabilities) < 0.75


TRIPLE = row_of((0.3, -0.2, 0.4), (-0.1, 0.25, -0.3))
SURE_OF_THREE = np.diag(
    np.array([*3 * [0.05, 0.05, 2e-3, 2e-3], *2 * [*3 * [np.radians(3e-4)], *3 * [0.003]]]) ** 2
)


@pytest.mark.parametrize("view", [0, 1, 2])
def test_the_view_that_turned_is_named_even_the_reference(view: int):
    turn = Pose.from_vectors(np.radians([0.02, 0.0, 0.0]), np.zeros(3)).rotation
    places = list(TRIPLE.cam_from_reference)
    for other, place in enumerate(places):
        if view == other != 0:
            places[other] = Pose(turn @ place.rotation, place.translation_mm)
        elif view == 0 != other:
            places[other] = Pose(place.rotation @ turn, place.translation_mm)
    true = replace(TRIPLE, cam_from_reference=tuple(places))
    drift = scene_drift(TRIPLE, SURE_OF_THREE, features_of(true, 6, 500, noise_px=0.15))
    assert drift.probability < 1e-6
    assert drift.alone == view


def test_the_least_of_some_chances_pays_for_their_number():
    assert least_chance({None: 0.1, 0: 0.3, 1: 0.02}) == pytest.approx(0.06)
    assert least_chance({None: 0.7, 2: 0.9}) == 1.0


def test_a_scene_without_texture_is_told():
    plain = [np.full((480, 640), 80, np.uint8)] * 2
    with pytest.raises(CalibrationError, match="right shares 0 features with left; 40 are needed"):
        look(RIG, [plain], 255)
