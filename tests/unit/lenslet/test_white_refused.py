"""White pictures that are none: every refusal says what was found and what to do."""

from typing import Any

import numpy as np
import pytest

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.lenslet.array import fit_array
from rig.lenslet.lattice import LatticeKind
from rig.lenslet.white import white_light
from tests.support.lenslet_raw import exposed, raw_format, true_array, without_some

SMALL = (280, 210)


def fit(light: Float, kind: LatticeKind = "hexagonal", spacing_px: float = 14.0, **asked: Any):
    return fit_array(exposed(light), raw_format(), kind, spacing_px, **asked)


def test_another_kind_of_lattice_is_told_with_its_spacing():
    with pytest.raises(CalibrationError, match=r"shows a square lattice of 14\.\d\d px"):
        fit(true_array("square", SMALL).white())


def test_another_spacing_is_told_with_both():
    with pytest.raises(CalibrationError, match=r"lie 14\.0\d px apart.*spacing_px is 16 px"):
        fit(true_array(size_px=SMALL).white(), spacing_px=16.0)


def test_a_scene_in_place_of_white_is_told():
    scene = np.random.default_rng(1).random((210, 280))
    with pytest.raises(CalibrationError, match=r"in no order|off the|asked for"):
        fit(scene)


def test_an_even_picture_is_told_to_have_too_few_micro_images():
    with pytest.raises(CalibrationError, match="found 0 micro-images"):
        fit(np.full((210, 280), 0.5))


def test_too_many_missing_lenslets_are_told_by_their_number():
    truth = without_some(true_array(size_px=SMALL), 0.25)
    with pytest.raises(CalibrationError, match=r"\d+ of \d+ lenslets show no micro-image"):
        fit(truth.white())


def test_a_saturated_picture_is_told_with_its_share():
    with pytest.raises(CalibrationError, match=r"\d\d\.\d % of the white picture is saturated"):
        fit(1.5 * true_array(size_px=SMALL).white())


def test_a_dark_picture_is_told_with_its_light():
    with pytest.raises(CalibrationError, match=r"are \d\.\d grey levels above dark, 16 are"):
        fit(0.002 * true_array(size_px=SMALL).white())


def test_a_dark_picture_of_another_size_is_told_with_both():
    with pytest.raises(CalibrationError, match="has 10 x 20 px, the white one 280 x 210"):
        fit(true_array(size_px=SMALL).white(), dark=np.zeros((20, 10), np.uint16))


def test_a_colour_without_light_is_told():
    raw = exposed(true_array(size_px=SMALL).white())
    raw[::2, ::2] = 64
    with pytest.raises(CalibrationError, match=r"has 0\.0 % of the light of the brightest"):
        white_light(raw, raw_format(is_bayer=True))
