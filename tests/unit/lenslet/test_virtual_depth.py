"""Slopes as virtual depth."""

import numpy as np
import pytest

from rig.capture.virtual_depth import virtual_depth_of
from rig.lenslet.lattice import Lattice
from rig.lenslet.virtual_depth import virtual_depth
from rig.profile.load import load_profile


def test_motions_between_views_and_between_micro_images_are_each_others_inverse():
    square = Lattice("square", (0.0, 10.0, 0.0), (0.0, 0.0, 10.0), 1.0, 0.0, 0.0)
    slopes = np.array([[0.5, -0.25, 0.0, np.nan]], np.float32)

    found = virtual_depth(slopes, square, 2.0)

    # Half a lenslet per step of 2 px is 4 px per lenslet: the spacing over 2.5.
    assert found == pytest.approx(np.array([[2.5, -1.25, 0.0, np.nan]]), nan_ok=True)
    assert found.dtype == np.float32


def test_columns_of_a_hexagonal_lattice_are_narrower_than_its_spacing():
    hexagonal = Lattice("hexagonal", (0.0, 10.0, 0.0), (0.0, 0.0, 10.0), 1.0, 0.0, 0.0)

    found = virtual_depth(np.array([[0.5]], np.float32), hexagonal, 2.0)

    assert found == pytest.approx(2.5 * np.sqrt(0.75))


def test_a_rig_without_calibrated_lenslets_has_no_virtual_depth():
    assert virtual_depth_of(load_profile("sim")) is None
    assert virtual_depth_of(load_profile("sim-lenslet")) is None
