"""Gains, light, row errors and left-out views: limits from both sides, sums written out."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews
from rig.epipolar.mending.corner_rows import CornersBeside, rows_of_corners
from rig.epipolar.mending.first_match import FirstMatch, first_match
from rig.epipolar.mending.gains import Gains, fit_gains, middle
from rig.epipolar.mending.light import LightField, fit_light
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.photometry import equalise
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.mending.smooth_field import (
    HELD,
    TERMS,
    SmoothField,
    basis,
    coarse_rms,
    fit_field,
    grid_of,
    is_sure,
    robust_gain,
    values_everywhere,
)
from rig.epipolar.mending.usable import (
    keep,
    moving_views,
    saturation_grey,
    seen_views,
    strange_views,
)
from rig.epipolar.noise.model import CrossNoise
from rig.epipolar.search.window import Cameras, window_of
from rig.errors import SlopeError

Array = NDArray[np.float64]
RNG = np.random.default_rng(111)


def test_gains_are_applied_joined_and_compared():
    first = Gains(np.array([2.0, 0.5]), np.array([3.0, -1.0]))
    then = Gains(np.array([4.0, 3.0]), np.array([1.0, 2.0]))
    assert first.of(10.0).tolist() == [23.0, 4.0]
    both = then.after(first)
    assert both.gain.tolist() == [8.0, 1.5]
    assert both.offset.tolist() == [13.0, -1.0]
    assert both.of(10.0).tolist() == [4 * 23 + 1, 3 * 4 + 2]
    grey = np.array([[1.0, 2.0], [4.0, 6.0]])
    assert first.misfit(grey, np.array([9.0, 9.0])).tolist() == [[4.0, 2.0], [8.0, 7.0]]
    assert Gains.none(2).of(7.0).tolist() == [7.0, 7.0]


def test_the_middle_is_the_larger_of_two():
    values = np.array([[5.0, 1.0, 3.0, 9.0], [4.0, 2.0, 8.0, 6.0]])
    useful = np.array([[True, True, True, True], [True, True, False, True]])
    assert middle(values, useful).tolist() == [5.0, 4.0]
    assert middle(values[:1], useful).tolist() == [5.0, 5.0]


def plain_gains(x: Array, y: Array) -> tuple[float, float]:
    """Four rounds of Cauchy weights about a line as steep as the ratio of the spreads."""
    smallest = 1e-3 * y.std() + 1e-9

    def upper_median(values: Array) -> float:
        return float(np.sort(values)[len(values) // 2])

    gain, offset = 1.0, upper_median(y) - upper_median(x)
    for _ in range(4):
        square = (y - gain * x - offset) ** 2
        w = 1 / ((1.5 * upper_median(square) ** 0.5 + smallest) ** 2 + square)
        mx, my = np.average(x, weights=w), np.average(y, weights=w)
        vx, vy = np.average((x - mx) ** 2, weights=w), np.average((y - my) ** 2, weights=w)
        gain = float(np.sqrt(vy / vx))
        offset = float(my - gain * mx)
    return gain, offset


def test_lines_of_grey_values_are_as_steep_as_their_spreads_tell():
    target = RNG.uniform(20, 200, 150)
    grey = np.stack([(target - 12) / 1.3, 1.1 * target + 5])
    grey += RNG.normal(0, 4, grey.shape)
    grey[:, :30] = RNG.uniform(0, 250, (2, 30))
    useful = RNG.random(grey.shape) < 0.8
    found = fit_gains(grey, target, useful)
    for view in (0, 1):
        chosen = useful[view]
        expected = plain_gains(grey[view, chosen], target[chosen])
        assert found.gain[view] == pytest.approx(expected[0], rel=1e-3)
        assert found.offset[view] == pytest.approx(expected[1], abs=0.1)


def test_a_view_without_spread_keeps_its_gain():
    target = np.array([10.0, 20.0, 30.0])
    flat = fit_gains(np.full((1, 3), 7.0), target, np.ones((1, 3), np.bool_))
    assert flat.gain[0] == 1.0
    assert flat.offset[0] == pytest.approx(13.0, abs=0.5)
    dark = fit_gains(np.array([[1.0, 2.0, 4.0]]), np.full(3, 9.0), np.ones((1, 3), np.bool_))
    assert dark.gain[0] == 1.0


SHAPE = (60, 80)


def legendre(t: Array) -> list[Array]:
    return [
        np.ones_like(t), t, (3 * t**2 - 1) / 2, (5 * t**3 - 3 * t) / 2,
        (35 * t**4 - 30 * t**2 + 3) / 8,
    ]  # fmt: skip


def test_fields_are_products_of_legendre_polynomials():
    x, y = RNG.uniform(0, 79, 30), RNG.uniform(0, 59, 30)
    along, down = legendre(2 * x / 79 - 1), legendre(2 * y / 59 - 1)
    expected = [along[i] * down[n - i] for n in range(5) for i in range(n + 1)]
    assert basis(x, y, SHAPE) == pytest.approx(np.stack(expected, axis=1))
    assert TERMS == 15
    degrees = [n for n in range(5) for _ in range(n + 1)]
    assert pytest.approx(0.6 ** np.array(degrees)) == HELD


def test_a_grid_reaches_all_corners():
    x, y = grid_of(SHAPE)
    assert len(x) == 17 * 17
    assert (x[0], x[1], x[-1], y[0], y[17], y[-1]) == (0.0, 79 / 16, 79.0, 0.0, 59 / 16, 59.0)


def plain_field(
    x: Array, y: Array, values: Array, sigmas: Array, scale: float
) -> tuple[Array, Array, float]:
    design, prior = basis(x, y, SHAPE), np.diag(1 / (scale * HELD) ** 2)
    found, covariance, spread = np.zeros(TERMS), prior, 1.0
    found[0] = np.median(values)
    for _ in range(5):
        rest = (values - design @ found) / sigmas
        spread = 1.4826 * np.median(np.abs(rest))
        w = 1 / (sigmas * spread) ** 2 / (1 + (rest / (2.4 * spread)) ** 2)
        covariance = np.linalg.inv(design.T @ (w[:, None] * design) + prior)
        found = covariance @ design.T @ (w * values)
    return found, covariance, float(spread * np.median(sigmas))


def test_fields_are_robust_ridge_regressions():
    x, y = RNG.uniform(0, 79, 150), RNG.uniform(0, 59, 150)
    sigmas = RNG.uniform(0.05, 0.3, 150)
    values = 1.5 * (x / 79) * (y / 59) - 0.4 + sigmas * RNG.normal(size=150)
    values[:20] += 3.0
    found = fit_field(x, y, values, sigmas, SHAPE, 2.0)
    expected = plain_field(x, y, values, sigmas, 2.0)
    assert found.coefficients == pytest.approx(expected[0], rel=1e-6, abs=1e-9)
    assert found.covariance == pytest.approx(expected[1], rel=1e-6, abs=1e-12)
    assert found.scatter == pytest.approx(expected[2])
    at = np.array([3.0, 70.0]), np.array([50.0, 8.0])
    design = basis(*at, SHAPE)
    assert found.at(*at) == pytest.approx(design @ expected[0])
    variance = np.diag(design @ expected[1] @ design.T)
    assert found.sigma_at(*at) == pytest.approx(variance**0.5)


def test_fields_add_up():
    one = SmoothField(np.arange(15.0), SHAPE, np.eye(15), 0.1)
    two = SmoothField(np.ones(15), SHAPE, 2 * np.eye(15), 0.2)
    assert two.on_top_of(None) is two
    both = two.on_top_of(one)
    assert both.coefficients.tolist() == (np.arange(15.0) + 1).tolist()
    assert both.scatter == 0.2


def test_what_varies_at_a_glance_is_the_rms_of_the_medians_of_sixteen_cells():
    rows, columns = np.mgrid[0:60:3, 0:80:4]
    x, y = columns.ravel().astype(float), rows.ravel().astype(float)
    values = (x // 20) * 2.0 + (y // 15) * 1.0 - 3.0
    cells = [2.0 * i + 1.0 * k - 3.0 for i in range(4) for k in range(4)]
    expected = float(np.sqrt(np.mean(np.square(cells))))
    assert coarse_rms(x, y, values, SHAPE) == pytest.approx(expected)
    # Beyond the picture is its rim; a cell of four says nothing.
    assert coarse_rms(x + 200, y + 200, np.full(len(x), 2.0), SHAPE) == pytest.approx(2.0)
    four, five = np.full(4, 5.0), np.full(5, 5.0)
    assert coarse_rms(four, four, four, SHAPE) == 0.0
    assert coarse_rms(five, five, five, SHAPE) == 5.0


def test_a_gain_is_the_fall_of_the_cauchy_loss():
    gain = robust_gain(np.array([2.0]), np.array([1.0]), 0.5)
    assert gain == pytest.approx(np.log(17.0) - np.log(5.0))
    # Mean 1 over an error of 0.5 / 2: four of its errors are not enough, a little more is.
    assert not is_sure(np.array([0.5, 1.5, 0.5, 1.5]) * 1.0 + 0.0)
    assert is_sure(np.array([0.51, 1.49, 0.51, 1.49]))


def plain_light(x: Array, y: Array, grey: Array, left: Array, level: float) -> tuple[Array, float]:
    places = basis(x, y, SHAPE)
    design = np.hstack([places * (grey / level)[:, None], places])
    prior = np.diag(1 / np.concatenate([0.15 * level * HELD, 0.1 * level * HELD]) ** 2)
    found = np.zeros(30)
    for _ in range(4):
        rest = left - design @ found
        scatter = 1.4826 * np.median(np.abs(rest))
        w = 1 / (1 + (rest / (2.4 * scatter)) ** 2) / scatter**2
        found = np.linalg.solve(design.T @ (w[:, None] * design) + prior, design.T @ (w * left))
    return found, float(np.sqrt(np.mean((design @ found) ** 2)))


def test_light_is_a_robust_field_of_gain_and_of_offset():
    count, gain, offset = 400, 1.1, -6.0
    x, y = RNG.uniform(0, 79, count), RNG.uniform(0, 59, count)
    grey = RNG.uniform(40, 200, count)
    target = gain * grey + offset + 0.1 * (x / 79) * grey + 9.0 * (y / 59 - 0.5)
    target += RNG.normal(0, 1, count)
    found = fit_light(x, y, grey, target, SHAPE, gain, offset)
    level = float(np.mean(np.abs(target)))
    told, rms = plain_light(x, y, gain * grey + offset, target - gain * grey - offset, level)
    assert found is not None
    assert found.rms_levels == pytest.approx(rms, rel=1e-6)
    assert found.gain == pytest.approx(told[:15] / level, rel=1e-5, abs=1e-9)
    assert found.offset == pytest.approx(
        (told[15:] + offset * told[:15] / level) / gain, rel=1e-5, abs=1e-7
    )
    picture = RNG.uniform(0, 200, SHAPE).astype(np.float32)
    times, added = values_everywhere(found.gain, SHAPE), values_everywhere(found.offset, SHAPE)
    assert found.of(picture) == pytest.approx(picture * (1 + times) + added, rel=1e-5)


@pytest.mark.parametrize(("count", "is_told"), [(30, False), (31, True)])
def test_thirty_pairs_tell_no_light(count: int, is_told: bool):
    x, y = np.linspace(0, 79, count), np.linspace(0, 59, count)
    grey = np.full(count, 100.0)
    found = fit_light(x, y, grey, grey + 20.0, SHAPE, 1.0, 0.0)
    assert (found is not None) == is_told


@pytest.mark.parametrize(("levels", "is_told"), [(0.47, False), (0.9, True)])
def test_light_of_half_a_per_cent_is_the_same(levels: float, is_told: bool):
    x, y = RNG.uniform(0, 79, 600), RNG.uniform(0, 59, 600)
    grey = np.full(600, 100.0)
    found = fit_light(x, y, grey, grey + levels + 1e-3 * x, SHAPE, 1.0, 0.0)
    assert (found is not None) == is_told


def views_of(images: NDArray[np.generic], **changes: object) -> RectifiedViews:
    count = len(images)
    x = np.arange(count) - 1.0
    return replace(
        RectifiedViews(images, x, np.zeros(count), 1),  # pyright: ignore[reportArgumentType]
        **changes,
    )


def noise_pictures(count: int = 5, spread: float = 20.0) -> NDArray[np.float32]:
    return RNG.normal(100, spread, (count, 50, 60)).astype(np.float32)


def test_grey_values_are_clipped_where_more_than_a_five_hundredth_is_at_the_top():
    images = np.zeros((1, 50, 100), np.uint8)
    sample = images[:, ::5, ::5]
    assert sample.size == 200
    images[0, 0, 0] = 9
    assert saturation_grey(images) == 9.0
    images = np.zeros((1, 250, 100), np.uint8)
    images[0, 0, 0] = images[0, 0, 5] = 9  # two of a thousand
    assert np.isinf(saturation_grey(images))
    images[0, 5, 0] = 9
    assert saturation_grey(images) == 9.0
    images[0, 1, 1] = 200  # not looked at
    assert saturation_grey(images) == 9.0


def test_saturated_pictures_are_named_with_their_share():
    images = np.clip(noise_pictures(), 0, 120)
    share = float((images[:, ::5, ::5] == 120).mean())
    assert f"{100 * share:.0f} % of the pixels are saturated" in seen_views(views_of(images))[1][0]
    few = noise_pictures()
    few[:, ::5, ::5][0, :1, :12] = few.max() + 1  # 12 of 600: a fiftieth
    assert seen_views(views_of(few))[1] == ()
    few[:, ::5, ::5][0, 1, 0] = few.max()
    assert "2 % of the pixels are saturated" in seen_views(views_of(few))[1][0]


@pytest.mark.parametrize(("spread", "is_left_out"), [(0.3, True), (0.5, False)])
def test_a_view_with_a_fiftieth_of_the_usual_spread_shows_nothing(spread: float, is_left_out: bool):
    images = noise_pictures()
    images[3] = RNG.normal(100, spread, (50, 60))
    kept, said = seen_views(views_of(images))
    assert len(kept.images) == (4 if is_left_out else 5)
    assert any("view 3 at (2, 0) shows nothing (grey spread 0.3" in text for text in said) == (
        is_left_out
    )


def test_a_dark_rig_keeps_its_reference_and_refuses_to_go_on_alone():
    images = noise_pictures(3)
    images[[0, 2]] = 50.0
    with pytest.raises(SlopeError, match="only 1 of 3 views show anything"):
        seen_views(views_of(images))
    images[0] = noise_pictures(1)[0]
    assert len(seen_views(views_of(images))[0].images) == 2
    bad = noise_pictures(3)
    bad[0, 3, 3] = np.nan
    with pytest.raises(SlopeError, match="not finite"):
        seen_views(views_of(bad))


@pytest.mark.parametrize(
    ("agreement", "strange"),
    [
        ([0.9, 1.0, 0.35, 0.8], [2]),
        ([0.9, 1.0, 0.37, 0.8], []),  # four tenths of 0.9 are 0.36
        ([0.5, 1.0, 0.1, 0.3], [2]),
        ([0.49, 1.0, 0.1, 0.3], []),  # none agrees well enough to tell
        ([0.1, 0.0, 0.9, 0.1], [0, 3]),
    ],
)
def test_views_that_agree_little_are_strange(agreement: list[float], strange: list[int]):
    found, said = strange_views(views_of(noise_pictures(4)), np.array(agreement))
    assert np.flatnonzero(found).tolist() == strange
    assert [text.split(" ")[1] for text in said] == [str(i) for i in strange]


def test_frozen_views_are_left_out_unless_too_few_are_left():
    views = views_of(noise_pictures(3))
    assert moving_views(views, ()) == (views, ())
    kept, said = moving_views(views, (2,))
    assert kept.x_steps.tolist() == [-1.0, 0.0]
    assert said == ("view 2 at (1, 0) repeats its last picture; it was left out",)
    for frozen in ((1,), (0, 2)):
        with pytest.raises(SlopeError, match="repeat their last picture bit for bit"):
            moving_views(views, frozen)


def test_what_is_kept_of_views_stays_together():
    rows = RowErrors.none(4)
    rows = replace(rows, rms_px=np.arange(4.0))
    lost = Mending(rows, ((None,) * 4,), CrossNoise(2.0))
    views = views_of(
        noise_pictures(4), beside_px=np.arange(8.0).reshape(4, 2), mending=lost, row_errors=rows
    )
    kept = keep(views, np.array([False, True, False, True]))
    assert kept.reference == 0
    assert kept.beside_px is not None
    assert kept.beside_px.tolist() == [[2.0, 3.0], [6.0, 7.0]]
    assert kept.mending is not None
    assert kept.mending.rows.rms_px.tolist() == [1.0, 3.0]
    assert kept.mending.light == ((None, None),)
    assert kept.mending.noise == CrossNoise(2.0)
    assert kept.row_errors is not None
    assert kept.row_errors.rms_px.tolist() == [1.0, 3.0]
    bare = keep(views_of(noise_pictures(3)), np.array([True, True, False]))
    assert bare.reference == 1
    assert (bare.beside_px, bare.mending, bare.row_errors) == (None, None, None)


def flat_field(size_px: float, shape: tuple[int, int] = SHAPE, sigma: float = 0.0) -> SmoothField:
    coefficients, covariance = np.zeros(TERMS), np.zeros((TERMS, TERMS))
    coefficients[0], covariance[0, 0] = size_px, sigma**2
    return SmoothField(coefficients, shape, covariance, 0.1)


@pytest.mark.parametrize(
    ("size_px", "across", "place", "said"),
    [
        (0.8, (0.0, 1.0), (5.0, 5.0), "0.8 px low at the top left"),
        (-0.8, (0.0, 1.0), (40.0, 30.0), "0.8 px high at the middle centre"),
        (0.8, (0.0, -1.0), (79.0, 59.0), "0.8 px high at the bottom right"),
        (1.26, (1.0, 0.0), (26.0, 19.0), "1.3 px too far right at the top left"),
        (1.26, (-1.0, 0.0), (27.0, 21.0), "1.3 px too far left at the middle centre"),
        (0.8, (-0.6, 0.8), (54.0, 41.0), "0.8 px low at the bottom right"),
    ],
)
def test_row_errors_say_how_far_which_way_and_where(
    size_px: float, across: tuple[float, float], place: tuple[float, float], said: str
):
    at = np.array([place[0]]), np.array([place[1]])
    found = RowErrors.of((flat_field(size_px),), np.array([across]), [at])
    assert found.worst == (said,)
    assert found.rms_px == pytest.approx([abs(size_px)])
    assert found.lines(["left"]) == (f"rows: left is {said}; calibrate",)
    (warning,) = found.warnings(np.array([1.5]), np.array([0.25]))
    assert warning.startswith(f"rows: view 0 at (1.5, 0.25) is {said} ({abs(size_px):.2f} px rms)")


def test_rows_that_meet_or_are_not_known_are_no_error():
    at, across = (np.array([5.0]), np.array([5.0])), np.array([[0.0, 1.0]])
    for field in (flat_field(0.049), flat_field(0.4, sigma=0.21), None):
        found = RowErrors.of((field,), across, [at])
        assert (found.any, found.worst, found.scatter_px) == (False, ("",), 0.0)
    assert RowErrors.of((flat_field(0.051),), across, [at]).any
    known = RowErrors.of((flat_field(0.4, sigma=0.19),), across, [at])
    assert known.any
    # What every patch is off by is no scatter of the rows.
    assert known.scatter_px == pytest.approx((0.1**2 - 0.05**2) ** 0.5)
    nowhere = np.zeros(0), np.zeros(0)
    assert not RowErrors.of((flat_field(3.0),), across, [nowhere]).any


def test_row_errors_that_are_left_add_to_those_that_were_known():
    at = np.array([40.0]), np.array([30.0])
    across = np.array([[0.0, 1.0], [0.0, 1.0], [1.0, 0.0]])
    first = RowErrors.of(
        (flat_field(0.5), None, flat_field(0.02)), across, [at, at, at], np.array([0.1, 0.2, 0.3])
    )
    left = RowErrors.of((flat_field(0.3), flat_field(-0.4), None), across, [at, at, at])
    both = first.plus(left)
    assert both.rms_px == pytest.approx([0.8, 0.4, 0.0])
    assert both.worst[0].startswith("0.8 px low")
    assert both.worst[1].startswith("0.4 px high")
    assert both.fields[2] is first.fields[2]
    assert both.per_slope.tolist() == [0.1, 0.2, 0.3]
    none = RowErrors.none(3)
    assert first.plus(none) is first
    onto = none.plus(left)
    assert onto.rms_px == pytest.approx([0.3, 0.4, 0.0])
    assert onto.across.tolist() == across.tolist()
    # A field that was known to be nothing is replaced, not added to.
    meeting = RowErrors.of((flat_field(0.04), None, None), across, [at, at, at])
    assert meeting.plus(left).rms_px[0] == pytest.approx(0.3)


def test_row_errors_of_another_number_of_views_are_refused():
    with pytest.raises(ValueError, match="for 2 views"):
        RowErrors((None, None), np.zeros((2, 2)), np.zeros(1), ("", ""), np.zeros(2))
    with pytest.raises(ValueError, match="1 descriptions of 2 views"):
        RowErrors((None, None), np.zeros((2, 2)), np.zeros(2), ("",), np.zeros(2))


def test_pictures_are_moved_by_their_row_errors():
    picture = RNG.uniform(0, 200, SHAPE).astype(np.float32)
    at = np.array([40.0]), np.array([30.0])
    across = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    found = RowErrors.of((flat_field(2.0), flat_field(-3.0), None), across, [at, at, at])
    mended = found.mended(np.stack([picture, picture, picture]))
    assert mended[0, :-2] == pytest.approx(picture[2:], abs=1e-3)
    assert mended[0, -1] == pytest.approx(picture[-1], abs=1e-3)
    assert mended[1, :, 3:] == pytest.approx(picture[:, :-3], abs=1e-3)
    assert np.array_equal(mended[2], picture)


@pytest.mark.parametrize(("spread_px", "is_told"), [(0.4, False), (0.7, True)])
def test_corners_tell_what_follows_the_slope_where_slopes_spread(spread_px: float, is_told: bool):
    x, y = RNG.uniform(0, 79, 400), RNG.uniform(0, 59, 400)
    slope = spread_px * RNG.normal(size=400)
    beside = 0.5 + 0.2 * slope + 1e-3 * RNG.normal(size=400)
    seen: list[CornersBeside | None] = [None, CornersBeside(x, y, slope, beside)]
    found = rows_of_corners(seen, np.array([0.0, 1.0]), np.zeros(2), SHAPE)
    assert found.per_slope == pytest.approx([0.0, 0.2 if is_told else 0.0], abs=1e-3)
    assert found.rms_px[1] == pytest.approx(0.5, abs=0.02)
    assert found.across.tolist() == [[0.0, 0.0], [0.0, 1.0]]


def test_a_slope_that_corners_do_not_follow_is_not_taken_off():
    x, y = RNG.uniform(0, 79, 400), RNG.uniform(0, 59, 400)
    noise = CornersBeside(x, y, 2 * RNG.normal(size=400), 0.02 * RNG.normal(size=400))
    found = rows_of_corners([noise], np.array([0.0]) + 1, np.zeros(1), SHAPE)
    assert found.per_slope.tolist() == [0.0]


@pytest.mark.parametrize(("count", "is_known"), [(15, False), (16, True)])
def test_as_many_corners_as_terms_tell_no_field(count: int, is_known: bool):
    x, y = RNG.uniform(0, 79, count), RNG.uniform(0, 59, count)
    some = CornersBeside(x, y, np.zeros(count), np.zeros(count))
    found = rows_of_corners([some], np.ones(1), np.zeros(1), SHAPE)
    assert (found.fields[0] is not None) == is_known


@pytest.mark.parametrize(
    ("side", "factor"), [(47, 1), (48, 1), (95, 1), (96, 2), (192, 4), (400, 4)]
)
def test_a_first_match_is_of_a_quarter_but_no_less_than_48_px(side: int, factor: int):
    images = np.zeros((2, side, 400), np.uint8)
    cameras = Cameras(np.array([0.0, 1.0]), np.zeros(2), 0)
    window = window_of((side, 400), (-0.5, 0.5), None)
    found = first_match(images, cameras, window)
    assert found.factor == factor
    assert found.images.shape == (2, side // factor, 400 // factor)
    # So narrow a range is as good as known.
    assert found.is_told
    assert not found.slope_px.any()


def test_light_is_named_from_two_levels():
    rows = RowErrors.none(2)

    def said(levels: float) -> tuple[str, ...]:
        field = LightField(np.zeros(15), np.zeros(15), levels)
        return Mending(rows, ((None, None), (None, field))).warnings(
            np.array([0.0, 1.5]), np.array([0.0, -0.5])
        )

    assert said(2.0) == ()
    (text,) = said(2.1)
    assert text.startswith("light: view 1 at (1.5, -0.5) differs from the reference by 2.1 levels")


def pairs_scene(count: int) -> tuple[NDArray[np.float32], Cameras, FirstMatch]:
    rows, columns = np.mgrid[0:count, 0:60].astype(float)
    picture = 100 + 40 * np.sin(0.4 * columns) * np.cos(0.3 * rows)
    images = np.stack([picture, (picture - 8) / 1.25]).astype(np.float32)
    cameras = Cameras(np.array([0.0, 1.0]), np.zeros(2), 0)
    return images, cameras, FirstMatch(images, 1, np.zeros((count, 60), np.float32), False)


def test_views_are_brought_to_the_grey_scale_of_the_reference():
    images, cameras, first = pairs_scene(40)
    equal = equalise(images, cameras, first)
    assert equal.images[1] == pytest.approx(images[0], abs=0.05)
    assert np.array_equal(equal.images[0], images[0])
    assert equal.agreement == pytest.approx([1.0, 1.0], abs=1e-3)
    assert equal.light == (None, None)
    field = LightField(np.zeros(15), np.eye(15)[0] * 5.0, 5.0)
    known = equalise(images, cameras, first, (None, field))
    assert known.light == (None, field)
    assert known.images[1] == pytest.approx(images[0], abs=0.05)


def test_unrelated_pictures_do_not_agree():
    images, cameras, first = pairs_scene(40)
    other = RNG.permutation(images[1].ravel()).reshape(images[1].shape)
    mixed = np.stack([images[0], other]).astype(np.float32)
    found = equalise(mixed, cameras, replace(first, pictures=mixed))
    assert found.agreement[1] < 0.5


@pytest.mark.parametrize(("count", "is_told"), [(1, False), (2, True)])
def test_a_hundred_pairs_are_needed(count: int, is_told: bool):
    # 60 pixels in a row: one row is too few, two are enough.
    images, cameras, first = pairs_scene(count)
    found = equalise(images, cameras, first)
    assert (np.abs(found.images[1] - images[0]).max() < 1.0) == is_told
    assert found.agreement[0] == 1.0
