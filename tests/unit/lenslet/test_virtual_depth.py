"""Slopes as inverse virtual depth."""

import numpy as np
import pytest

from rig.lenslet.lattice import Lattice
from rig.lenslet.virtual_depth import inverse_virtual_depth


def test_motions_between_views_and_between_micro_images_are_each_others_inverse():
    square = Lattice("square", (0.0, 10.0, 0.0), (0.0, 0.0, 10.0), 1.0, 0.0, 0.0)
    slopes = np.array([[0.5, -0.25, 0.0]], np.float32)

    found = inverse_virtual_depth(slopes, square, 2.0)

    # Half a lenslet per step of 2 px is 4 px per lenslet: 0.4 of the spacing.
    assert found == pytest.approx(np.array([[0.4, -0.8, np.inf]]))


def test_columns_of_a_hexagonal_lattice_are_narrower_than_its_spacing():
    hexagonal = Lattice("hexagonal", (0.0, 10.0, 0.0), (0.0, 0.0, 10.0), 1.0, 0.0, 0.0)

    found = inverse_virtual_depth(np.array([[0.5]], np.float32), hexagonal, 2.0)

    assert found == pytest.approx(0.4 / np.sqrt(0.75))
