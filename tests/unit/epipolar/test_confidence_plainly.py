"""Sigma and label of single pixels, term by term."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.confidence import Evidence, contradicted, judge
from rig.epipolar.line import HALF_HIDDEN, SEEN, UNSEEN, LineFits
from rig.epipolar.plain import has_coarse_texture, is_plain
from rig.epipolar.scales import Scales
from rig.epipolar.views import Label, SlopeMap

SHAPE = (41, 51)
HERE = (20, 25)
STEP_PX, RANGE_PX = 0.5, (-6.0, 8.0)
BLIND_PX = 14.0 / 12**0.5


def filled(value: float) -> NDArray[np.float32]:
    return np.full(SHAPE, value, np.float32)


def none() -> NDArray[np.bool_]:
    return np.zeros(SHAPE, np.bool_)


LINES = LineFits(
    filled(0.0), filled(100.0), filled(80.0), filled(0.0), filled(0.0), filled(1.0),
    np.full(SHAPE, SEEN, np.uint8),
)  # fmt: skip
EVIDENCE = Evidence(
    lines=LINES, variance=filled(0.04), views=5, misfit_px=0.3, hidden=none(),
    unshared=none(), start_px=2.0, rival_px=filled(np.nan),
)  # fmt: skip


def told(evidence: Evidence, slope: NDArray[np.float32] | float = 1.0) -> SlopeMap:
    slopes = slope if isinstance(slope, np.ndarray) else filled(slope)
    return judge(slopes, evidence, STEP_PX, RANGE_PX, ("said before",))


def at_one(values: NDArray[np.float32], value: float) -> NDArray[np.float32]:
    values = values.copy()
    values[HERE] = value
    return values


def marked() -> NDArray[np.bool_]:
    marks = none()
    marks[HERE] = True
    return marks


def test_sigma_adds_noise_what_the_start_leaves_and_what_lines_miss():
    # A fifth of the start's error is left: 100 of information, of which 80 are signal.
    square = 0.04 + (2.0 * 0.2) ** 2 + 0.3**2
    assert told(EVIDENCE).sigma_px[HERE] == pytest.approx(square**0.5)
    assert told(EVIDENCE).slope_px[HERE] == 1.0
    assert told(EVIDENCE).warnings == ("said before",)
    scattered = replace(EVIDENCE, variance=filled(0.12))
    assert told(scattered).sigma_px[HERE] == pytest.approx((square + 0.08) ** 0.5)
    drifting = replace(EVIDENCE, drift_variance=filled(0.5))
    assert told(drifting).sigma_px[HERE] == pytest.approx((square + 0.5) ** 0.5)
    both = replace(drifting, unconfirmed_variance=at_one(filled(0.0), 0.7))
    assert told(both).sigma_px[HERE] == pytest.approx((square + 1.2) ** 0.5)
    assert told(both).sigma_px[0, 0] == pytest.approx((square + 0.5) ** 0.5)
    rivalled = replace(EVIDENCE, rival_px=at_one(EVIDENCE.rival_px, 2.5))
    assert told(rivalled).sigma_px[HERE] == pytest.approx((square + 2.25) ** 0.5)
    assert told(rivalled).sigma_px[0, 0] == pytest.approx(square**0.5)


@pytest.mark.parametrize(("signal", "share"), [(-30.0, 1.0), (130.0, 0.0), (25.0, 0.75)])
def test_the_share_of_the_start_that_is_left_is_between_none_and_all(signal: float, share: float):
    lines = replace(LINES, signal=filled(signal))
    # Patches without signal would be plain; what pictures of half the size show tells them apart.
    evidence = replace(EVIDENCE, lines=lines, coarse_texture=~none())
    square = 0.04 + (2.0 * share) ** 2 + 0.3**2
    assert told(evidence).sigma_px[HERE] == pytest.approx(square**0.5)


def test_the_share_is_that_of_the_seven_pixels_around():
    lines = replace(LINES, signal=at_one(LINES.signal, 80.0 + 49 * 10.0))
    found = told(replace(EVIDENCE, lines=lines)).sigma_px
    near = (0.04 + (2.0 * 0.1) ** 2 + 0.09) ** 0.5
    far = (0.04 + (2.0 * 0.2) ** 2 + 0.09) ** 0.5
    assert found[20, 22:29] == pytest.approx([near] * 7)
    assert found[20, [21, 29]] == pytest.approx([far] * 2)


def test_sigma_is_at_most_that_of_a_guess():
    unknown = replace(EVIDENCE, variance=at_one(EVIDENCE.variance, np.inf))
    assert told(unknown).sigma_px[HERE] == pytest.approx(BLIND_PX)


def test_what_is_contradicted_is_blind_unless_the_other_view_finds_it_too():
    contested = replace(EVIDENCE, lines=replace(LINES, misfit=filled(3.0)))
    found = told(replace(contested, confirmed=marked()))
    assert found.sigma_px[HERE] == pytest.approx((0.04 + (2.0 * 0.2) ** 2 + 0.3**2) ** 0.5)
    assert found.sigma_px[0, 0] == pytest.approx(BLIND_PX)
    assert found.label[0, 0] == Label.NEARER
    misled = told(replace(EVIDENCE, is_misled=True))
    assert (misled.sigma_px == np.float32(BLIND_PX)).all()
    assert misled.warnings[0] == "said before"
    assert "contradict the hypothesis" in misled.warnings[1]
    lines = replace(LINES, misfit=filled(3.0))
    assert told(replace(EVIDENCE, lines=lines)).sigma_px[HERE] == pytest.approx(BLIND_PX)


def test_labels_tell_the_side_of_the_focus_and_what_is_hidden():
    slope = filled(1.0)
    slope[:, :10], slope[:, 10:20] = 0.0, -1.0
    label = told(replace(EVIDENCE, hidden=marked()), slope).label
    assert label[5, [5, 15, 30]].tolist() == [Label.BEYOND, Label.BEYOND, Label.NEARER]
    assert label[HERE] == Label.OCCLUSION


@pytest.mark.parametrize("name", ["plain", "unseen", "unshared", "high", "low"])
def test_no_answer_is_given_where_nothing_is_known(name: str):
    evidence, slope = EVIDENCE, filled(1.0)
    match name:
        case "plain":
            evidence = replace(evidence, lines=replace(LINES, signal=filled(0.0)))
        case "unseen":
            sight = LINES.sight.copy()
            sight[HERE] = UNSEEN
            evidence = replace(evidence, lines=replace(LINES, sight=sight))
        case "unshared":
            evidence = replace(evidence, unshared=marked())
        case "high":
            slope[HERE] = 7.51
        case _:
            slope[HERE] = -5.51
    found = told(evidence, slope)
    assert found.label[HERE] == Label.NONE
    assert np.isnan(found.slope_px[HERE])
    assert np.isnan(found.sigma_px[HERE])
    others = found.label[0, 0]
    assert (others == Label.NONE) == (name == "plain")


def test_half_hidden_pixels_and_slopes_just_inside_the_range_are_answered():
    lines = replace(LINES, sight=np.full(SHAPE, HALF_HIDDEN, np.uint8))
    assert told(replace(EVIDENCE, lines=lines)).label[HERE] == Label.NEARER
    assert (told(EVIDENCE, 7.49).label == Label.NEARER).all()
    assert (told(EVIDENCE, -5.49).label == Label.BEYOND).all()
    # A narrow range has an end of a tenth of itself.
    narrow = judge(filled(0.9), EVIDENCE, STEP_PX, (0.0, 1.0), ())
    assert narrow.label[HERE] == Label.NEARER
    assert judge(filled(0.91), EVIDENCE, STEP_PX, (0.0, 1.0), ()).label[HERE] == Label.NONE
    assert judge(filled(0.09), EVIDENCE, STEP_PX, (0.0, 1.0), ()).label[HERE] == Label.NONE


@pytest.mark.parametrize(("slope", "end"), [(7.9, "near"), (-5.9, "far")])
def test_more_than_a_fiftieth_at_an_end_of_the_range_is_named(slope: float, end: str):
    slopes = filled(1.0)
    slopes.ravel()[:42] = slope  # of 2091: just above a fiftieth
    said = told(EVIDENCE, slopes).warnings[1]
    assert f"2 % of the pixels are at the {end} end" in said
    assert "[-6, 8] px per view step" in said
    slopes.ravel()[41] = 1.0
    assert told(EVIDENCE, slopes).warnings == ("said before",)
    # What is plain is not there to be found.
    plain = replace(EVIDENCE, lines=replace(LINES, signal=filled(0.0)))
    assert told(plain, slope).warnings == ("said before",)


def test_pixels_at_a_jump_may_belong_to_its_other_side():
    slope = filled(1.0)
    slope[:, 26:] = 2.0
    square = told(EVIDENCE, slope).sigma_px[20, [24, 25, 26, 27, 23, 28]] ** 2
    base = 0.04 + 0.16 + 0.09
    # Three tenths of a jump by 1 px; within two pixels of it, one on either side and one beyond.
    assert square == pytest.approx([base + 0.09] * 4 + [base] * 2)
    slope[:, 26:] = 1.74
    assert told(EVIDENCE, slope).sigma_px[20, 25] ** 2 == pytest.approx(base)
    slope[:, 26:] = 4.0
    # But no more than seven tenths of a label.
    assert told(EVIDENCE, slope).sigma_px[20, 25] ** 2 == pytest.approx(base + 0.35**2)


def missing(misfit: NDArray[np.float32]) -> LineFits:
    return replace(LINES, misfit=misfit)


def test_what_views_contradict_spreads_over_a_region_that_is_contradicted_by_half():
    misfit = filled(0.0)
    misfit[:, :30] = 2.0
    found = contradicted(missing(misfit))
    assert (found[:, :28] == 1).all()
    # A spot is 5 pixels wide: the limit of 1.65 lies where more than 4 of them are contradicted.
    assert found[20, 35] == found[20, 40] == 0
    stripe = filled(0.0)
    stripe[:, 24:27] = 3.0
    # Three of five pixels with 3 are 1.8 in the mean.
    assert np.flatnonzero(contradicted(missing(stripe))[20]).tolist() == [24, 25, 26]
    misfit = filled(1.6)
    assert not contradicted(missing(misfit)).any()
    assert contradicted(missing(filled(1.7))).all()
    stripes = filled(0.0)
    stripes[:, np.arange(51) % 12 < 9] = 3.0
    assert contradicted(missing(stripes))[20, 20:30].all()
    stripes[:, np.arange(51) % 12 >= 4] = 0.0
    assert not contradicted(missing(stripes))[20, 20:30].all()


def test_texture_must_exceed_what_noise_pretends_by_four_sigmas():
    squares = 17**2 * 4
    chance = 4 * (8 / squares) ** 0.5
    share = chance / (1 + chance)
    for factor, expected in ((0.99, 1), (1.01, 0)):
        lines = replace(LINES, signal=filled(100 * share * factor))
        assert (is_plain(lines, 5) == expected).all()
    chance = 4 * (8 / 17**2) ** 0.5
    share = chance / (1 + chance)
    for views in (1, 2):
        lines = replace(LINES, signal=filled(99 * share))
        assert (is_plain(lines, views) == 1).all()
        assert (is_plain(replace(LINES, signal=filled(101 * share)), views) == 0).all()


@pytest.mark.parametrize("is_row", [True, False])
@pytest.mark.parametrize(("noise", "is_alike"), [(4.0, False), (4.0, True)])
def test_coarse_texture_is_steeper_than_noise_at_half_the_size(
    is_row: bool, noise: float, is_alike: bool
):
    chance = 4 * (8 / 9**2) ** 0.5
    left = 0.85 * noise if is_alike else noise / 2
    # Half the power of a difference of two, and the share that noise may pretend.
    limit = (0.5 * left**2 * (1 + chance)) ** 0.5
    scales = Scales(noise=noise, texture=1.0, is_alike=is_alike)
    for factor, expected in ((0.99, False), (1.01, True)):
        slope = 0.5 * factor * limit  # per pixel of full size
        ramp = slope * np.arange(80.0, dtype=np.float32) + np.zeros((80, 80), np.float32)
        grey = ramp if is_row else ramp.T
        found = has_coarse_texture(np.ascontiguousarray(grey), scales, is_row=is_row)
        assert found.shape == (80, 80)
        assert found[30:50, 30:50].all() == expected
        assert not has_coarse_texture(grey.T.copy(), scales, is_row=is_row).any()


def test_a_picture_of_three_pixels_has_no_coarse_texture():
    scales = Scales(noise=0.0, texture=1.0)
    steep = 9 * np.arange(60.0, dtype=np.float32) + np.zeros((3, 60), np.float32)
    assert not has_coarse_texture(steep, scales, is_row=True).any()
    assert has_coarse_texture(np.vstack([steep, steep[:1]]), scales, is_row=True).any()
