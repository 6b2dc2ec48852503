"""Sub-aperture views: places in the micro-image, devignetted, on one upright grid."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from rig_sim.lenslets.array import TrueArray

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.lenslet import views as views_module
from rig.lenslet.array import ARRAY_JSON, LensletArray, columns_of, fit_array, numbers_of
from rig.lenslet.lattice import LatticeKind
from rig.lenslet.match import shows_the_lattice
from rig.lenslet.plan import plan_views
from rig.lenslet.views import TOP, sub_apertures, view_size_px
from tests.support.lenslet_raw import (
    COLOURS,
    DARK,
    FULL,
    WHITE,
    exposed,
    fitted,
    in_images,
    raw_format,
    true_array,
)

OFFSETS_PX = np.array([(0, 0), (-3.5, 0), (2.2, 0), (0, -3.1), (0, 3.6), (2.0, -2.0)])
SLOW = [("hexagonal", False), ("hexagonal", True), ("square", True)]
KINDS = [pytest.param("hexagonal", marks=pytest.mark.slow), "square"]


def light_of(views: NDArray[np.uint16]):
    """Grey values of a raw picture that views stand for."""
    return views.astype(float) / TOP * (FULL - DARK)


@pytest.mark.parametrize(
    ("kind", "is_bayer"),
    [("square", False), *(pytest.param(*one, marks=pytest.mark.slow) for one in SLOW)],
)
def test_views_of_white_are_even_and_stand_where_they_are_asked(kind: LatticeKind, is_bayer: bool):
    truth, array = fitted(kind, is_bayer)
    plan = plan_views(array, OFFSETS_PX)
    passed, along, across = in_images(truth)

    white = light_of(sub_apertures(exposed(passed, is_bayer=is_bayer), array, plan))
    # Light that grows evenly over the micro-image tells where in it a view looks.
    places = []
    for place in (along, across):
        ramp = exposed(passed * (1.0 + place / 10.0) / 2.0, is_bayer=is_bayer)
        places.append((2.0 * light_of(sub_apertures(ramp, array, plan)) / white - 1.0) * 10.0)

    middle = WHITE * (COLOURS.mean() if is_bayer else 1.0)
    assert white.mean(axis=(1, 2)) == pytest.approx(middle, rel=0.01)
    assert (white.std(axis=(1, 2)) / white.mean(axis=(1, 2))).max() < 0.01
    found = np.stack(places, axis=-1)
    assert found.mean(axis=(1, 2)) == pytest.approx(OFFSETS_PX, abs=0.01)
    assert np.abs(found - OFFSETS_PX[:, None, None]).max() < 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_a_view_is_an_upright_picture_of_square_pixels(kind: LatticeKind):
    truth, array = fitted(kind)
    plan = plan_views(array, OFFSETS_PX[:1])
    x, y = truth.pixels()
    i, j = truth.cells(x, y)
    s, t = array.lattice.places(*_own_numbers(truth, array, i, j))
    column_px = math.sqrt(0.75) if kind == "hexagonal" else 1.0
    waves = 0.5 + 0.3 * np.cos(0.5 * s / column_px + 0.3 * t / column_px)

    view = light_of(sub_apertures(exposed(truth.passed(x, y, i, j) * waves), array, plan))[0]

    height, width = view.shape
    assert (width, height) == view_size_px(array, plan)
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    basis = np.stack(
        [
            np.ones(view.size),
            np.cos(0.5 * column + 0.3 * row).ravel(),
            np.sin(0.5 * column + 0.3 * row).ravel(),
        ],
        axis=-1,
    )
    solution, (left,), *_ = np.linalg.lstsq(basis, view.ravel())
    assert solution[0] == pytest.approx(0.5 * WHITE, rel=0.01)
    assert math.hypot(solution[1], solution[2]) == pytest.approx(0.3 * WHITE, rel=0.01)
    assert math.sqrt(left / view.size) < 0.02 * 0.3 * WHITE


def _own_numbers(
    truth: TrueArray, array: LensletArray, i: NDArray[np.int64], j: NDArray[np.int64]
) -> tuple[Float, Float]:
    """Numbers of the fitted lattice of the true lenslets (i, j); their origins differ."""
    centre = truth.centres_px(np.array([0]), np.array([0]))
    own_i, own_j = (np.rint(n) for n in array.lattice.numbers(centre))
    return i + own_i[0], j + own_j[0]


def test_noise_of_a_view_is_foretold_by_the_plan():
    truth, array = fitted("square")
    plan = plan_views(array, OFFSETS_PX)
    light = truth.white()
    noisy = exposed(0.7 * light, noise=0.02)
    still = exposed(0.7 * light)

    error = light_of(sub_apertures(noisy, array, plan)) - light_of(
        sub_apertures(still, array, plan)
    )

    in_sigmas = error / (plan.noise_gain * 0.02 * WHITE)
    assert in_sigmas.std() == pytest.approx(1.0, abs=0.05)
    # (1 2 1) / 4 and linear interpolation, both ways: from 0.3125 halfway to 0.375 on a pixel.
    assert 0.30 < float(np.median(plan.noise_gain[0])) < 0.40


def test_missing_lenslets_take_the_mean_of_those_around_them():
    truth, array = fitted("square")
    gains = array.gains.copy()
    gains[8, 9] = 0.0
    plan = plan_views(replace(array, gains=gains), OFFSETS_PX[:1])
    row, column = (int(n[0]) for n in np.nonzero(~plan.usable))
    x, y = truth.pixels()
    i, j = truth.cells(x, y)
    ramp = 0.5 + 0.01 * j

    whole = light_of(sub_apertures(exposed(truth.passed(x, y, i, j) * ramp), array, plan))[0]

    around = whole[row - 1 : row + 2, column - 1 : column + 2]
    assert whole[row, column] == pytest.approx((around.sum() - whole[row, column]) / 8, abs=0.5)
    assert whole[row, column] == pytest.approx(around[1].mean(), rel=0.01)


def test_rows_of_a_hexagonal_lattice_stand_above_each_other():
    i, j = np.array([0, 0, -1, 1, 0]), np.array([0, 1, 2, -1, -2])

    q = columns_of("hexagonal", i, j)

    assert q.tolist() == [0, 0, 0, 0, -1]
    assert numbers_of("hexagonal", q, j).tolist() == i.tolist()
    assert columns_of("square", i, j).tolist() == i.tolist()


def test_a_view_outside_of_its_micro_image_is_told_with_the_most_that_it_holds():
    _, array = fitted("square")
    with pytest.raises(CalibrationError, match=r"6\.50 px from the middle.*views up to 6\.00 px"):
        plan_views(array, np.array([(6.5, 0.0)]))


@pytest.mark.slow
def test_a_view_without_light_in_the_corners_shrinks_the_picture_and_is_told_in_the_end():
    truth = true_array("square", (560, 420), barrel_px=6.0, barrel_shift=0.02)
    array, _ = fit_array(exposed(truth.white()), raw_format(), "square", 14.0)
    near = plan_views(array, np.array([(0.0, 0.0)])).usable.shape
    far = plan_views(array, np.array([(-4.5, 0.0), (4.5, 0.0)])).usable.shape

    assert far[1] < near[1]
    with pytest.raises(CalibrationError, match="has light only in less than 40 %"):
        plan_views(array, np.array([(-5.9, 0.0), (5.9, 0.0)]))


def test_an_array_comes_back_from_json_to_the_last_digit():
    _, array = fitted("square")

    back = ARRAY_JSON.from_text(json.dumps(ARRAY_JSON.to_json(array)))

    assert back.lattice == array.lattice
    assert np.array_equal(back.vignetting.table, array.vignetting.table)
    assert np.array_equal(back.gains, array.gains)


@pytest.mark.parametrize("kind", KINDS)
def test_a_picture_is_told_from_one_whose_lattice_lies_elsewhere(kind: LatticeKind):
    truth, array = fitted(kind)
    scene = 0.3 + 0.2 * np.random.default_rng(2).random((240, 320))
    raw = exposed(truth.white() * scene)

    assert shows_the_lattice(raw, array)
    assert not shows_the_lattice(np.roll(raw, (7, 7), axis=(0, 1)), array)
    assert not shows_the_lattice(exposed(scene), array)


@pytest.mark.parametrize("first_row", [0, 1, 4])
def test_rows_that_are_shifted_by_half_a_spacing_come_to_common_columns(first_row: int):
    def light(x: Float) -> Float:
        return 100.0 + 20.0 * np.cos(0.3 * x)

    column = np.arange(30.0)
    shifts = [0.5 * ((first_row + row) % 2 == 0) for row in range(5)]
    rows = np.stack([light(column - shift) for shift in shifts])[None].astype(np.float32)
    upright = views_module._upright(rows, first_row, 20)
    expected = light(np.arange(20.0) * views_module._COLUMN_STEP)
    assert upright[0, :, 2:] == pytest.approx(np.tile(expected[2:], (5, 1)), abs=0.05)
