"""From rendered pictures to a geometry: matches, what is measured of them, and the whole."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from rig_sim.optics import TrueCamera

from rig.epipolar.scene.found import find_geometry
from rig.epipolar.scene.match import match_features
from rig.epipolar.scene.prior import Sureness
from rig.errors import CalibrationError
from tests.support.scene_features import rows_missed_px
from tests.support.scene_pictures import cards, geometry_of, photographs, true_camera

SURE = Sureness(focal_pct=0.5, centre_px=2.0, turn_deg=2.0, length_pct=0.5, direction_deg=2.0)
TURNS = ((1.6, -1.1, 2.0), (-1.2, 1.4, -1.8), (0.9, 1.9, 1.1))
PLACES = ((0.0, 0.0, 0.0), (75.0, 0.0, 0.0), (0.0, 75.0, 0.0))
BENT = (-0.06, 0.02, 0.0, 0.0, 0.0)
STRAIGHT = (0.0, 0.0, 0.0, 0.0, 0.0)


def rendered(
    views: int, lens: tuple[float, float, float, float, float] = STRAIGHT
) -> tuple[list[TrueCamera], list[list[NDArray[np.uint8]]]]:
    """Misaligned cameras, the last with a lens, and two scenes that they see."""
    cameras = [true_camera("abc"[k], PLACES[k], TURNS[k]) for k in range(views)]
    cameras[-1] = replace(cameras[-1], distortion=lens)
    return cameras, [photographs(cameras, cards(seed), seed) for seed in (1, 2)]


def rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_a_shifted_picture_is_matched_by_its_shift():
    wide = cv2.GaussianBlur(np.random.default_rng(3).uniform(0, 255, (140, 240)), (0, 0), 2.0)
    levels = ((wide - wide.min()) / np.ptp(wide) * 1023).astype(np.uint16)
    found = match_features([levels[10:130, 20:220], levels[7:127, 8:208]], 1, 5, 1023)
    shift = found.view_px[:, 0] - found.reference_px
    assert len(found) > 60
    assert np.median(shift, axis=0) == pytest.approx([-12.0, -3.0], abs=0.05)
    assert set(found.picture.tolist()) == {5}
    assert np.isnan(found.view_px[:, 1]).all()


def test_pictures_without_texture_are_told_so():
    plain = [np.full((120, 160), 90, np.uint8)] * 2
    start = geometry_of([true_camera("ab"[k], PLACES[k], size_px=(160, 120)) for k in range(2)])
    with pytest.raises(CalibrationError, match="b shares 0 features with a in 1 pictures; 25"):
        find_geometry([plain], 255, start, SURE)


@pytest.mark.slow
def test_a_rig_turned_by_two_degrees_is_rectified_to_a_hundredth():
    cameras, pictures = rendered(2)
    found = find_geometry(pictures, 255, geometry_of(cameras, turned=False), SURE)
    assert rms(rows_missed_px(found.fit.geometry, geometry_of(cameras))) < 0.02
    assert found.before is None
    assert found.fields[0] is None
    field = found.fields[1]
    assert field is not None
    assert field.rms_px < 0.02
    assert field.scatter_px < 1.25 * field.about_px  # 15 terms take their part of 150 features


@pytest.mark.slow
def test_three_views_in_an_angle_are_rectified_too():
    cameras, pictures = rendered(3)
    found = find_geometry(pictures, 255, geometry_of(cameras, turned=False), SURE)
    assert rms(rows_missed_px(found.fit.geometry, geometry_of(cameras))) < 0.02


@pytest.mark.slow
def test_lenses_that_differ_are_found_where_turns_do_not_reach_it():
    cameras, pictures = rendered(2, BENT)
    start = geometry_of(cameras, turned=False)
    plain = tuple(replace(c, lens="none", coefficients=()) for c in start.cameras)
    found = find_geometry(pictures, 255, replace(start, cameras=plain), SURE)
    assert found.before is not None
    left = found.before[1]
    assert left is not None
    assert left.rms_px > 0.1
    kept = find_geometry(pictures, 255, replace(start, cameras=plain), SURE, "kept")
    assert kept.before is None
    assert kept.fields[1] is not None
    assert kept.fields[1].rms_px > 0.1
    true = geometry_of(cameras)
    missed = rms(rows_missed_px(found.fit.geometry, true))
    assert missed < 0.5 * rms(rows_missed_px(kept.fit.geometry, true))
