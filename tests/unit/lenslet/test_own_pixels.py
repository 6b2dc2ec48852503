"""Which pixels belong to a micro-image, against distances in closed form."""

import numpy as np
import pytest

from rig.lenslet import vignetting
from rig.lenslet.lattice import Lattice, LatticeKind

PITCH_PX = 10.0


def even(kind: LatticeKind) -> Lattice:
    """A lattice along the rows of the picture, without distortion, about (50, 40)."""
    return Lattice(kind, (50.0, PITCH_PX, 0.0), (40.0, 0.0, PITCH_PX), 1.0, 0.0, 0.0)


def test_neighbours_of_a_square_lattice_are_the_eight_around():
    found = vignetting._neighbours_px(even("square"))
    around = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if (x, y) != (0, 0)]
    assert sorted(map(tuple, np.round(found / PITCH_PX, 9).tolist())) == around


def test_neighbours_of_a_hexagonal_lattice_hold_the_six_nearest():
    apart_px = np.sort(np.linalg.norm(vignetting._neighbours_px(even("hexagonal")), axis=1))
    assert apart_px[:6] == pytest.approx(PITCH_PX)
    assert (apart_px[6:] > PITCH_PX * 1.5).all()


@pytest.mark.parametrize("kind", ["square", "hexagonal"])
def test_a_pixel_belongs_to_the_nearest_centre(kind: LatticeKind):
    beside_px = vignetting._neighbours_px(even(kind))
    far_px = np.random.default_rng(3).uniform(-PITCH_PX, PITCH_PX, (400, 2))
    for x_px, y_px in far_px.tolist():
        own = np.hypot(x_px, y_px)
        others = np.hypot(x_px - beside_px[:, 0], y_px - beside_px[:, 1])
        assert vignetting._is_own(x_px, y_px, beside_px) == bool(own < others.min())
