"""Pictures of any size and content get an answer or a refusal, nothing else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.epipolar import RectifiedViews, SlopeMap, SlopePrior, estimate_slopes
from rig.epipolar.views import Label
from rig.errors import SlopeError
from tests.support.lightfield import noise_texture

RANGE_PX = (-2.0, 2.0)
PLACES = np.array([[0.0, 0.0], [1.0, 0.0], [-1.1, 0.0], [0.0, 0.9], [0.0, -1.0]])
TOPS = {"uint8": 255, "uint16": 65535, "float32": 1}


def views_of(
    seed: int, shape: tuple[int, int], views: int, kind: str, *, is_colour: bool, content: str
) -> RectifiedViews:
    """Random or constant pictures, or one random picture moved by a whole px per step."""
    rng = np.random.default_rng(seed)
    size = (views, *shape, 3) if is_colour else (views, *shape)
    if content == "constant":
        grey = np.full(size, 0.4)
    elif content == "other":
        grey = rng.random(size)
    else:
        one = rng.random(size[1:])
        moves = np.rint(PLACES[:views]).astype(int)
        grey = np.stack([np.roll(one, (-y, -x), axis=(0, 1)) for x, y in moves])
    images = (grey * TOPS[kind]).astype(kind)
    return RectifiedViews(images, PLACES[:views, 0], PLACES[:views, 1], 0)


def answer(
    views: RectifiedViews,
    range_px: tuple[float, float] = RANGE_PX,
    prior: SlopePrior | None = None,
) -> SlopeMap | None:
    """What `estimate_slopes` says, checked for form; None where it refuses."""
    try:
        found = estimate_slopes(views, range_px, prior)
    except SlopeError:
        return None
    none = found.label == Label.NONE
    assert found.slope_px.shape == found.sigma_px.shape == found.label.shape == views.shape
    assert np.array_equal(np.isnan(found.slope_px), none)
    assert np.array_equal(np.isnan(found.sigma_px), none)
    assert (found.sigma_px[~none] > 0).all()
    return found


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 1000),
    shape=st.tuples(st.integers(2, 40), st.integers(2, 40)),
    views=st.integers(2, 5),
    kind=st.sampled_from(sorted(TOPS)),
    is_colour=st.booleans(),
    content=st.sampled_from(["constant", "other", "moved"]),
)
def test_small_pictures_are_answered_or_refused(
    seed: int, shape: tuple[int, int], views: int, kind: str, is_colour: bool, content: str
) -> None:
    answer(views_of(seed, shape, views, kind, is_colour=is_colour, content=content))


@pytest.mark.parametrize("is_colour", [False, True], ids=["grey", "colour"])
@pytest.mark.parametrize("content", ["constant", "other", "moved"])
@pytest.mark.parametrize("shape", [(2, 2), (8, 8), (200, 12), (3, 300)])
def test_narrow_pictures_are_answered_or_refused(
    shape: tuple[int, int], content: str, is_colour: bool
) -> None:
    for views in (2, 5):
        answer(views_of(1, shape, views, "uint8", is_colour=is_colour, content=content))


def test_what_a_narrow_picture_shows_is_found() -> None:
    texture = noise_texture(3, mean=120.0, contrast=30.0, finest_px=2.0)
    rows, columns = np.indices((200, 16)).astype(np.float64)
    grey = np.stack([texture(columns + 0.8 * x, rows + 0.8 * y) for x, y in PLACES])
    images = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    found = answer(RectifiedViews(images, PLACES[:, 0], PLACES[:, 1], 0))
    assert found is not None
    error = np.abs(found.slope_px - 0.8)
    assert np.nanmedian(error) < 0.05
    assert np.mean(error < 0.3) > 0.9


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1)])
def test_a_picture_of_one_row_or_column_is_refused(shape: tuple[int, int]) -> None:
    images = np.zeros((2, *shape), np.uint8)
    with pytest.raises(SlopeError, match=f"{shape[1]} x {shape[0]} px"):
        RectifiedViews(images, np.array([0.0, 1.0]), np.zeros(2), 0)


@pytest.mark.parametrize("shape", [(2, 60), (60, 2), (3, 3), (4, 4)])
def test_what_is_too_small_to_be_searched_coarsely_is_searched_as_it_is(shape: tuple[int, int]):
    images = np.random.default_rng(0).uniform(0, 200, (3, *shape)).astype(np.float32)
    views = RectifiedViews(images, np.array([-1.0, 0.0, 1.0]), np.zeros(3), 1)
    assert answer(views, (-30.0, 30.0)) is not None


def test_a_few_lost_pixels_of_a_small_picture_are_searched_too() -> None:
    images = np.random.default_rng(0).uniform(0, 200, (3, 5, 40)).astype(np.float32)
    views = RectifiedViews(images, np.array([-1.0, 0.0, 1.0]), np.zeros(3), 1)
    slope, sigma = np.zeros((5, 40), np.float32), np.full((5, 40), 0.1, np.float32)
    slope[2, 20] = np.nan
    assert answer(views, (-30.0, 30.0), SlopePrior(slope, sigma)) is not None
