"""A board that keeps its tilt, told from cameras that are turned by a little."""

import numpy as np
import pytest

from rig.curve import BoardTilt, Curve, CurvePoint, FieldTerm, fit_curve, fit_field
from rig.depth import depth_from_slopes
from rig.epipolar import SlopeMap
from rig.errors import CurveError

DISTANCES_MM = (400.0, 500.0, 600.0, 700.0, 850.0, 1000.0, 1200.0)
SIGMA = 2e-6
PITCH_MM = 40.0


def tilts(
    rise: tuple[float, float],
    field: tuple[float, float],
    seed: int,
    distances_mm: tuple[float, ...] = DISTANCES_MM,
) -> list[BoardTilt]:
    """Slope planes of a board whose depth rises right and down, seen by turned cameras."""
    noise = np.random.default_rng(seed).normal(0.0, SIGMA, (len(distances_mm), 2))
    return [
        BoardTilt(
            z_mm,
            (
                -PITCH_MM * rise[0] / z_mm + field[0] + off[0],
                -PITCH_MM * rise[1] / z_mm + field[1] + off[1],
            ),
            (SIGMA, SIGMA),
        )
        for z_mm, off in zip(distances_mm, noise.tolist(), strict=True)
    ]


def test_a_tilted_board_alone_makes_no_field() -> None:
    needless = 0
    for seed in range(40):
        found = fit_field(tilts((0.02, -0.01), (0.0, 0.0), seed), (320.0, 200.0))
        assert found is not None
        needless += found.term is not None
        if found.term is None:
            assert found.tilt_mm == pytest.approx((-0.8, 0.4), abs=6 * found.tilt_sigma_mm[0])
    # The rule of one standard error lets chance through now and then, never as a rule.
    assert needless <= 8


def test_a_field_is_found_beside_the_tilt_with_its_sigma() -> None:
    truth = (3e-5, -1.2e-5)
    misses: list[float] = []
    for seed in range(40):
        found = fit_field(tilts((0.02, -0.01), truth, seed), (320.0, 200.0))
        assert found is not None
        assert found.term is not None
        sigma = np.sqrt(np.diag(found.term.covariance))
        misses += ((np.array(found.term.per_px) - truth) / sigma).tolist()
        assert found.tilt_mm == pytest.approx((-0.8, 0.4), abs=6 * found.tilt_sigma_mm[0])
        assert found.left_out[1] < found.left_out[0]
    assert 0.6 < float(np.std(misses)) < 1.2


def test_few_distances_tell_nothing() -> None:
    assert fit_field([], (0.0, 0.0)) is None
    assert fit_field(tilts((0.0, 0.0), (0.0, 0.0), 1, (400.0, 600.0, 800.0, 900.0)), (0, 0)) is None


def curve(field: FieldTerm | None) -> Curve:
    points = [
        CurvePoint(z, 24400.0 / z - 35.0, 1e-3, 1e-3, 5, "fit", "forward") for z in DISTANCES_MM
    ]
    best = fit_curve(points).best
    return Curve(best.law, best.covariance, best.valid_mm, best.scatter_px, field)


FIELD = FieldTerm((80.0, 50.0), (2e-4, -1e-4), ((1e-10, 2e-11), (2e-11, 1e-10)))


def test_depth_is_that_of_the_slope_without_its_field() -> None:
    columns, rows = np.meshgrid(np.arange(160.0), np.arange(100.0))
    at_600 = 24400.0 / 600.0 - 35.0
    slope_px = (at_600 + 2e-4 * (columns - 80.0) - 1e-4 * (rows - 50.0)).astype(np.float32)
    slopes = SlopeMap(slope_px, np.full_like(slope_px, 0.01), np.ones(slope_px.shape, np.uint8))
    flat = depth_from_slopes(slopes, curve(FIELD), max_sigma_pct=1.0)
    assert np.abs(flat.depth_mm - 600.0).max() < 0.01
    bent = depth_from_slopes(slopes, curve(None), max_sigma_pct=1.0)
    assert np.ptp(bent.depth_mm) > 0.5
    # The field is not known exactly, and less so away from the axis.
    assert flat.sigma_mm[0, 0] > flat.sigma_mm[50, 80]


def test_sigma_grows_by_the_variance_of_the_field_at_the_pixel() -> None:
    slope_px = np.full((60, 100), 24400.0 / 600.0 - 35.0, np.float32)
    slope_px += FIELD.maps((60, 100))[0]
    slopes = SlopeMap(slope_px, np.full_like(slope_px, 0.001), np.ones(slope_px.shape, np.uint8))
    found = depth_from_slopes(slopes, curve(FIELD), max_sigma_pct=1.0)
    x, y = -80.0, -50.0
    own_px2 = 0.001**2 + float(curve(FIELD).curve_sigma_px(np.array([600.0]))[0]) ** 2
    sigma_px = np.sqrt(own_px2 + 1e-10 * (x * x + y * y) + 2 * 2e-11 * x * y)
    per_px = 24400.0 / (24400.0 / 600.0) ** 2
    assert found.sigma_mm[0, 0] == pytest.approx(sigma_px * per_px, rel=0.01)
    assert found.sigma_mm[50, 80] == pytest.approx(own_px2**0.5 * per_px, rel=0.01)


def test_a_field_is_linear_and_its_variance_a_square() -> None:
    term = FieldTerm((3.0, 2.0), (0.5, -0.25), ((4.0, 1.0), (1.0, 9.0)))
    slope, variance = term.maps((4, 6))
    y, x = np.mgrid[:4, :6] - np.array([2.0, 3.0])[:, None, None]
    assert slope == pytest.approx(0.5 * x - 0.25 * y)
    assert variance == pytest.approx(4 * x * x + 2 * x * y + 9 * y * y)
    assert term.slope_px(5.0, 7.0) == 0.5 * 2 - 0.25 * 5
    flat = FieldTerm((3.0, 2.0), (0.5, -0.25), ((0.0, 0.0), (0.0, 0.0)))
    assert flat.maps((4, 6))[1].max() == 0.0


def test_a_curve_with_a_field_survives_json_and_one_without_reads_as_before() -> None:
    for field in (FIELD, None):
        before = curve(field)
        content = before.to_json()
        assert ("field" in content) == (field is not None)
        assert Curve.from_json(content) == before


@pytest.mark.parametrize(
    "change",
    [{"extra": 1}, {"per_px": [1.0]}, {"per_px": ["1", 2.0]}, {"covariance": [[1.0, 0.0]]}],
)
def test_an_ill_formed_field_is_refused(change: dict[str, object]) -> None:
    content = curve(FIELD).to_json()
    content["field"] |= change
    with pytest.raises(CurveError, match=r"stored curve is ill-formed: field\."):
        Curve.from_json(content)


@pytest.mark.parametrize(
    ("per_px", "covariance"),
    [
        ((float("nan"), 0.0), ((1.0, 0.0), (0.0, 1.0))),
        ((0.0, 0.0), ((1.0, 2.0), (2.0, 1.0))),
    ],
)
def test_an_impossible_field_is_refused(
    per_px: tuple[float, float], covariance: tuple[tuple[float, float], tuple[float, float]]
) -> None:
    with pytest.raises(CurveError, match="cannot be used"):
        FieldTerm((0.0, 0.0), per_px, covariance)
