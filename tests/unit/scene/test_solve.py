"""The geometry that fits features of scenes: against closed form, noise and wrong matches."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar.scene.numbers import numbers_of, with_numbers
from rig.epipolar.scene.prior import Sureness, prior_of
from rig.epipolar.scene.rays import derivatives, misfit
from rig.epipolar.scene.rows import grid_features, rows_sigma_px
from rig.epipolar.scene.solve import across_px, fit_scene
from rig.geometry.rig_geometry import RigGeometry
from tests.support.scene_features import features_of, row_of, rows_missed_px

SURE = Sureness(focal_pct=0.5, centre_px=2.0, turn_deg=2.0, length_pct=0.5, direction_deg=2.0)
TURNED = (1.2, -0.8, 1.5)
PAIR = row_of(TURNED)
NOMINAL = row_of((0.0, 0.0, 0.0))


def turn_deg(geometry: RigGeometry, view: int = 1) -> list[float]:
    return np.degrees(geometry.cam_from_reference[view].rotation_rad).tolist()


def test_a_true_geometry_misses_nothing():
    at = misfit(PAIR, features_of(PAIR, 1))
    assert np.abs(at.residual).max() < 1e-6
    assert at.known.all()
    assert at.spare.tolist() == [1.0] * 400


def test_inverse_depths_are_those_of_the_points():
    near = features_of(PAIR, 1, depths_mm=(800.0, 800.001))
    assert misfit(PAIR, near).inverse_per_mm == pytest.approx(np.full(400, 1.0 / 800.0), rel=1e-5)


def test_a_turn_about_the_axis_lifts_what_is_beside_it():
    features = features_of(NOMINAL, 2, depths_mm=(1e6, 1.001e6))
    rolled = row_of((0.0, 0.0, 0.1))
    across = across_px(misfit(rolled, features), features)[:, 1]
    beside_px = features.view_px[:, 1, 0] - 319.5
    assert np.abs(across) == pytest.approx(np.radians(0.1) * np.abs(beside_px), abs=2e-3)


def test_misaligned_rigs_are_found():
    features = features_of(PAIR, 3)
    fit = fit_scene(NOMINAL, prior_of(NOMINAL, SURE), features)
    assert np.abs(rows_missed_px(fit.geometry, PAIR)).max() < 2e-3
    assert turn_deg(fit.geometry)[0] == pytest.approx(TURNED[0], abs=0.02)
    assert turn_deg(fit.geometry)[2] == pytest.approx(TURNED[2], abs=0.01)


def test_wrong_matches_do_not_pull():
    features = features_of(PAIR, 4, wrong=0.3, noise_px=0.1)
    fit = fit_scene(NOMINAL, prior_of(NOMINAL, SURE), features)
    assert np.sqrt(np.mean(rows_missed_px(fit.geometry, PAIR) ** 2)) < 0.03
    assert 0.65 < fit.fits.mean() < 0.78
    assert fit.scatter == pytest.approx(0.1, rel=0.2)


def test_three_views_tell_the_ratio_of_their_baselines():
    true = row_of(TURNED, (-0.5, 0.7, -1.0))
    moved = numbers_of(true)
    moved[21] = -151.2  # the farthest view stands 0.8 % farther than the profile says
    true, start = with_numbers(true, moved), row_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    fit = fit_scene(start, prior_of(start, SURE), features_of(true, 5, 200, noise_px=0.05))
    first, second = (np.linalg.norm(p.translation_mm) for p in fit.geometry.cam_from_reference[1:])
    assert second / first == pytest.approx(151.2 / 75.0, rel=1.5e-3)


def test_what_pictures_cannot_tell_stays_as_sure_as_it_was():
    fit = fit_scene(NOMINAL, prior_of(NOMINAL, SURE), features_of(PAIR, 6, noise_px=0.1))
    covariance = fit.geometry.covariance
    assert covariance is not None
    assert covariance[0, 0] ** 0.5 == pytest.approx(450.0 * 0.005 * 1.125**0.5, rel=0.01)
    assert covariance[11, 11] ** 0.5 == pytest.approx(0.375, rel=0.02)


@pytest.mark.slow
def test_errors_are_as_large_as_told():
    z: list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]] = []
    for seed in range(12):
        features = features_of(PAIR, 100 + seed, 150, noise_px=0.2)
        fit = fit_scene(PAIR, prior_of(PAIR, SURE), features)
        grid = grid_features(fit.geometry, 1.0 / np.array([600.0, 1000.0, 3000.0]))
        moves = derivatives(fit.geometry, grid, misfit(fit.geometry, grid))
        assert fit.geometry.covariance is not None
        sigma = np.sqrt(np.einsum("nvcp,pq,nvcq->nv", moves, fit.geometry.covariance, moves))
        away = across_px(misfit(PAIR, grid), grid)[:, 1]
        z.append(away / sigma[:, 1])
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.4


def test_neighbours_that_err_together_make_it_less_sure():
    features = features_of(PAIR, 7, noise_px=0.1)
    alone = fit_scene(PAIR, prior_of(PAIR, SURE), features)
    waves = np.sin(features.reference_px[:, 0] / 40.0) * np.sin(features.reference_px[:, 1] / 40.0)
    features.view_px[:, 1, 1] += 0.3 * waves
    together = fit_scene(PAIR, prior_of(PAIR, SURE), features)
    assert alone.clustering < 1.8
    assert together.clustering > 2.0
    depths = 1.0 / np.array([1000.0])
    assert rows_sigma_px(together.geometry, depths) > 2.0 * rows_sigma_px(alone.geometry, depths)


def test_rows_are_as_sure_as_the_pitch_of_a_view():
    rig = row_of((0.0, 0.0, 0.0))
    covariance = np.zeros((14, 14))
    covariance[8, 8] = np.radians(0.01) ** 2
    far = 1.0 / np.array([1e7])
    found = rows_sigma_px(replace(rig, covariance=covariance), far)
    v = np.linspace(-239.5, 239.5, 5) / 450.0
    # Across a line of a far point only the vertical motion counts: f (1 + v^2) theta.
    expected = 450.0 * np.radians(0.01) * np.sqrt(np.mean((1.0 + v**2) ** 2))
    assert found == pytest.approx(expected, rel=1e-3)
    assert np.isnan(rows_sigma_px(rig, far))
