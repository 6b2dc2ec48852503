"""Micro-images and the lattice behind them, against the closed form of the simulated array."""

import math

import numpy as np
import pytest
from rig_sim.lenslets.array import TrueArray

from rig.arrays import Float
from rig.lenslet.fit import fit_lattice
from rig.lenslet.lattice import Lattice, LatticeKind, terms
from rig.lenslet.white import RawFormat, white_light
from tests.support.lenslet_raw import exposed, true_array, without_some

STRAIGHT = Lattice("hexagonal", (100.0, 20.0, 0.0), (50.0, 0.0, 20.0), 2.0, 0.0, 0.0)


def corner_errors_px(truth: TrueArray, lattice: Lattice):
    """Distance of fitted from true centres at the corner lenslets and in the middle."""
    width, height = truth.width_px, truth.height_px
    middle = width // 2, height // 2
    right, low = width - 20, height - 20
    corners = np.array([(20, 20), (right, 20), (20, low), (right, low), middle], np.float64)
    i, j = (np.rint(n) for n in lattice.numbers(corners))
    centres = lattice.centres_px(i, j)
    true = truth.centres_px(*truth.cells(centres[:, 0], centres[:, 1]))
    return np.abs(centres - true).max(axis=1)


def test_powers_are_in_order():
    assert terms(np.array([2.0]), np.array([3.0]), 2).tolist() == [[1, 2, 3, 4, 6, 9]]


def test_a_hexagonal_lattice_shifts_its_rows_by_half_a_spacing():
    centres = STRAIGHT.centres_px(np.array([0, 1, 0]), np.array([0, 0, 1]))

    assert centres == pytest.approx(np.array([(100, 50), (110, 50), (105, 50 + 5 * math.sqrt(3))]))
    assert STRAIGHT.spacing_px == pytest.approx(10.0)
    assert STRAIGHT.rotation_rad == 0.0


def test_a_turned_lattice_tells_its_angle():
    cos, sin = 20 * math.cos(0.1), 20 * math.sin(0.1)
    turned = Lattice("square", (0.0, cos, -sin), (0.0, sin, cos), 2.0, 0.0, 0.0)

    assert turned.rotation_rad == pytest.approx(0.1)
    assert turned.spacing_px == pytest.approx(10.0)


def test_numbers_are_the_way_back_from_centres_also_through_a_distortion():
    bent = Lattice(
        "hexagonal",
        (100.0, 200.0, 3.0, 2.0, 1.0, -1.0, 4.0, 0.0, 3.0, 0.0),
        (80.0, -3.0, 200.0, 1.0, 0.5, 1.0, 0.0, 3.0, 0.0, 4.0),
        20.0,
        0.0,
        0.0,
    )
    i, j = np.array([3.0, -14.5, 8.25]), np.array([-7.0, 2.0, 12.5])

    back = bent.numbers(bent.centres_px(i, j))

    assert np.stack(back) == pytest.approx(np.stack([i, j]), abs=1e-9)


@pytest.mark.parametrize("kind", ["hexagonal", "square"])
@pytest.mark.parametrize("rotation_deg", [-10.0, 0.2, 10.0])
def test_clean_pictures_give_the_corners_to_five_thousandths_of_a_pixel(
    kind: LatticeKind, rotation_deg: float
):
    truth = true_array(kind, rotation_deg=rotation_deg)

    found = fit_lattice(truth.white().astype(np.float32), kind, 14.8)

    assert corner_errors_px(truth, found.lattice).max() < 0.005
    assert math.degrees(found.lattice.rotation_rad) == pytest.approx(rotation_deg, abs=0.01)
    assert found.lattice.spacing_px == pytest.approx(14.0, abs=0.002)
    assert len(found.lattice.x_px) == 3
    assert (found.missing, found.dirty) == ((), ())


@pytest.mark.parametrize(("kind", "rotation_deg"), [("hexagonal", 10.0), ("square", -10.0)])
def test_noise_colour_filters_and_missing_lenslets_cost_little(
    kind: LatticeKind, rotation_deg: float
):
    truth = without_some(true_array(kind, rotation_deg=rotation_deg), 0.05)
    raw = exposed(truth.white(), is_bayer=True, noise=0.02)
    white = white_light(raw, RawFormat(4095, is_bayer=True, dark_levels=64.0))

    found = fit_lattice(white.light, kind, 13.5)

    assert corner_errors_px(truth, found.lattice).max() < 0.02
    assert found.lattice.sigma_px == pytest.approx(0.005, abs=0.001)
    lost = set(
        zip(*(n.tolist() for n in truth.cells(*_places(found.lattice, found.missing))), strict=True)
    )
    assert 0.03 < len(found.missing) / (len(found.missing) + found.seen) < 0.07
    assert lost <= truth.missing


def _places(lattice: Lattice, numbers: tuple[tuple[int, int], ...]) -> tuple[Float, Float]:
    centres = lattice.centres_px(*np.array(numbers).T)
    return centres[:, 0], centres[:, 1]


def test_a_distortion_is_fitted_where_there_is_one():
    truth = true_array(distortion=0.004)

    found = fit_lattice(truth.white().astype(np.float32), "hexagonal", 14.0)

    assert len(found.lattice.x_px) == 10
    assert corner_errors_px(truth, found.lattice).max() < 0.02


def test_a_dirty_lenslet_is_named_and_has_no_say():
    truth = true_array("square", rotation_deg=3.0)
    light = truth.white()
    x, y = truth.pixels()
    i, j = truth.cells(x, y)
    dirty = (i == 4) & (j == -3)
    light[dirty & (x > truth.centres_px(i, j)[..., 0])] *= 0.4

    found = fit_lattice(light.astype(np.float32), "square", 14.0)

    named = found.lattice.centres_px(*np.array(found.dirty).T)
    assert truth.cells(named[:, 0], named[:, 1]) == (np.array([4]), np.array([-3]))
    assert corner_errors_px(truth, found.lattice).max() < 0.005


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hexagonal", "square"])
@pytest.mark.parametrize("rotation_deg", [-10.0, 10.0])
def test_a_distorted_bayer_picture_of_1400_px_with_noise(kind: LatticeKind, rotation_deg: float):
    truth = without_some(
        true_array(kind, (1400, 1000), rotation_deg=rotation_deg, distortion=0.004), 0.05
    )
    raw = exposed(truth.white(), is_bayer=True, noise=0.02)
    white = white_light(raw, RawFormat(4095, is_bayer=True, dark_levels=64.0))

    found = fit_lattice(white.light, kind, 14.0)

    assert corner_errors_px(truth, found.lattice).max() < 0.02
