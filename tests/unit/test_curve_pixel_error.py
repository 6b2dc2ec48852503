"""What one pixel of a map is off by, beside the plane of a whole board."""

import numpy as np
import pytest

from rig.curve import Curve, DepthError, Headline, PixelSigma, fit_curve, headline, pixel_errors
from rig.curve.physical import Physical
from tests.support.curve_points import exact_sweep

CURVE = Curve(
    Physical(a_px_mm=6000.0, m_inf_px=-6.0, z0_mm=0.0), ((0.0,) * 3,) * 3, (400.0, 2000.0), 0.0
)


def test_sigma_of_a_pixel_is_carried_to_depth_by_the_law():
    (error,) = pixel_errors(CURVE, [PixelSigma(1000.0, 0.003)], [1000.0])
    assert error.distance_mm == 1000.0
    # m = a / Z + m_inf: dZ/dm = Z^2 / a
    assert error.expanded_mm == pytest.approx(2 * 0.003 * 1000.0**2 / 6000.0)


def test_the_curve_adds_its_own_sigma():
    unsure = Curve(CURVE.law, ((0.0,) * 3, (0.0,) * 3, (0.0, 0.0, 0.004**2)), CURVE.valid_mm, 0.0)
    (error,) = pixel_errors(unsure, [PixelSigma(1000.0, 0.003)], [1000.0])
    assert error.expanded_mm == pytest.approx(2 * 0.005 * 1000.0**2 / 6000.0, rel=1e-6)


def test_between_stops_it_is_a_straight_line_and_stops_of_one_distance_are_averaged():
    pixels = [PixelSigma(1500.0, 0.04), PixelSigma(500.0, 0.01), PixelSigma(500.0, 0.03)]
    errors = pixel_errors(CURVE, pixels, [450.0, 500.0, 750.0, 1500.0, 1900.0])
    sigmas_px = [error.expanded_mm / 2 * 6000.0 / error.distance_mm**2 for error in errors]
    assert sigmas_px == pytest.approx([0.02, 0.02, 0.025, 0.04, 0.04])


def test_nothing_known_is_nothing_told():
    assert pixel_errors(CURVE, [], [1000.0]) == ()


def test_the_headline_names_board_plane_and_pixel():
    line = Headline(
        (400.0, 2500.0), (DepthError(1000.0, 0.1),), distances=4, pixels=(DepthError(1000.0, 1.84),)
    )
    assert str(line) == (
        "valid 0.40-2.50 m, board plane +-0.1 mm at 1 m, one pixel (median) +-1.8 mm at 1 m, "
        "k=2 (4 held-out distances)"
    )


def test_the_headline_of_a_sweep_quotes_both_at_one_distance():
    fit = fit_curve(exact_sweep(distances_mm=np.linspace(400.0, 1200.0, 17)), models=["physical"])
    line = headline(fit.best, fit.holdout, pixels=[PixelSigma(800.0, 0.02)])
    assert [error.distance_mm for error in line.pixels] == [1000.0]
    assert line.pixels == pixel_errors(fit.best, [PixelSigma(800.0, 0.02)], [1000.0])
    assert headline(fit.best, None, pixels=[PixelSigma(800.0, 0.02)]).pixels == ()
