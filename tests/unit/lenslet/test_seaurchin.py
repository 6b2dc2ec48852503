"""The white picture of a real light-field microscope, where it is at hand."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.lenslet.array import fit_array
from rig.lenslet.fit import fit_lattice, lenslets_inside
from rig.lenslet.plan import plan_views
from rig.lenslet.views import sub_apertures
from rig.lenslet.vignetting import fit_vignetting
from rig.lenslet.white import RawFormat, white_light
from tests.support.shared_data import SHARED

FOLDER = SHARED / "lenslet-seaurchin"
FORM = RawFormat(255, is_bayer=False, dark_levels=3.0)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not FOLDER.is_dir(), reason=f"not in {FOLDER}; set RIG_SHARED_DATA"),
]


@pytest.fixture(scope="module")
def white():
    return cv2.imread(str(FOLDER / "radiometry_frame.tif"), cv2.IMREAD_UNCHANGED)


def test_single_micro_images_lie_on_the_lattice(white: NDArray[np.uint8]):
    found = fit_lattice(white_light(white, FORM).light, "square", 17.0)

    assert found.lattice.residual_px < 0.15
    assert found.lattice.spacing_px == pytest.approx(17.21, abs=0.02)
    assert found.seen > 13_000


def test_vignetting_fitted_on_half_of_the_lenslets_holds_for_the_rest(white: NDArray[np.uint8]):
    light = white_light(white, FORM).light
    found = fit_lattice(light, "square", 17.0)
    i, j, centre_px = lenslets_inside(
        found.lattice, (2048, 2048), margin_px=0.75 * found.lattice.spacing_px
    )
    unusable = {*found.missing, *found.dirty}
    usable = np.array([one not in unusable for one in zip(i.tolist(), j.tolist(), strict=True)])
    half = (i + j) % 2 == 0
    vignetting = fit_vignetting(light, found.lattice, centre_px[usable & half])

    # Shape: mean over the held-out lenslets of every region and place of the micro-image.
    rest = centre_px[usable & ~half]
    base = np.rint(rest).astype(int)
    ratios = []
    for x, y in [(0, 0), (3, 0), (-3, 0), (0, 3), (0, -3), (2, 2), (-2, -2)]:
        pixel = base + np.array([x, y])
        fit = vignetting.light(rest, pixel - rest)
        ratios.append(light[pixel[:, 1], pixel[:, 0]] / fit)
    region = (rest[:, 1] // 256).astype(int) * 8 + (rest[:, 0] // 256).astype(int)
    means = [[ratio[region == n].mean() for n in range(64)] for ratio in ratios]
    rms = float(np.sqrt(np.mean((np.array(means) - 1.0) ** 2)))
    assert rms < 0.01


def test_views_of_the_white_picture_are_even(white: NDArray[np.uint8]):
    array, _ = fit_array(white, FORM, "square", 17.0)
    plan = plan_views(array, np.array([(0.0, 0.0), (2.0, 0.0), (0.0, -2.0)]))

    views = sub_apertures(white, array, plan).astype(float)

    inner = views[:, 4:-4, 4:-4]
    even = inner / inner.mean(axis=(1, 2), keepdims=True)
    assert float(np.median(np.abs(even - 1.0))) < 0.01


def test_white_over_its_fit_is_even_once_each_lenslet_has_its_gain(white: NDArray[np.uint8]):
    """Lenslets that took no part in the fit; each one's gain comes from every second pixel."""
    light = white_light(white, FORM).light
    found = fit_lattice(light, "square", 17.0)
    i, j, centre_px = lenslets_inside(
        found.lattice, (2048, 2048), margin_px=0.75 * found.lattice.spacing_px
    )
    unusable = {*found.missing, *found.dirty}
    usable = np.array([one not in unusable for one in zip(i.tolist(), j.tolist(), strict=True)])
    half = (i + j) % 2 == 0
    vignetting = fit_vignetting(light, found.lattice, centre_px[usable & half])
    rest = centre_px[usable & ~half]
    base = np.rint(rest).astype(int)

    seen, fitted = np.zeros((2, len(rest))), np.zeros((2, len(rest)))
    for x, y in np.ndindex(13, 13):
        away = np.array([x - 6, y - 6])
        if np.hypot(*away) > 6.0:
            continue
        pixel = base + away
        seen[(x + y) % 2] += light[pixel[:, 1], pixel[:, 0]]
        fitted[(x + y) % 2] += vignetting.light(rest, pixel - rest)

    gain = seen / fitted
    # Neighbouring lenslets differ in their light: no smooth vignetting tells that of the others.
    alone = float(np.sqrt(np.mean((gain[1] - 1.0) ** 2)))
    with_gain = float(np.sqrt(np.mean((gain[1] / gain[0] - 1.0) ** 2)))
    assert 0.01 < alone < 0.02
    assert with_gain < 0.01
