"""Links between saddles are edges only if the sides are right all along and beyond both ends."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.edge_links import are_edges
from rig.targets.saddles import Saddles

PLACES = {0.5: 1, -0.25: -1, 1.25: -1, 0.2: 1, 0.8: 1, 0.35: 1, 0.65: 1}


def ends(first: tuple[float, float], last: tuple[float, float], *contrasts: float) -> Saddles:
    contrast = np.array(contrasts or (100.0, 100.0))
    return Saddles(np.array([first, last]), np.zeros((2, 2, 2)), np.zeros((2, 2)), contrast)


def is_edge(picture: NDArray[np.float32], saddles: Saddles) -> bool:
    forth = are_edges(picture, saddles, np.array([0]), np.array([1]))
    back = are_edges(picture, saddles, np.array([1]), np.array([0]))
    assert forth.tolist() == back.tolist()
    return bool(forth[0])


def striped(*, flipped: tuple[float, ...] = (), flat: tuple[float, ...] = ()) -> Float:
    """Picture (90, 80) with an edge along y = 20 from x = 20 to 60; colours change at both ends."""
    side = np.where((np.arange(80) > 20) & (np.arange(80) < 60), 1.0, -1.0)
    for along in flipped:
        side[round(20 + 40 * along) - 2 :][:5] *= -1
    for along in flat:
        side[round(20 + 40 * along) - 2 :][:5] = 0
    below = np.where(np.arange(90) > 20, 50.0, -50.0)
    below[20] = 0.0
    return 100 + below[:, None] * side


@pytest.mark.parametrize("sign", [1, -1])
def test_an_edge_with_colours_that_change_at_both_ends_is_one(sign: int) -> None:
    picture = (100 + sign * (striped() - 100)).astype(np.float32)
    saddles = ends((20.0, 20.0), (60.0, 20.0))
    assert is_edge(picture, saddles)
    turned = Saddles(saddles.xy_px[:, ::-1], saddles.axes, saddles.bright, saddles.contrast)
    assert is_edge(np.ascontiguousarray(picture.T), turned)


@pytest.mark.parametrize("along", PLACES)
def test_one_place_that_is_wrong_turns_a_link_away(along: float) -> None:
    saddles = ends((20.0, 20.0), (60.0, 20.0))
    assert not is_edge(striped(flipped=(along,)).astype(np.float32), saddles)
    assert not is_edge(striped(flat=(along,)).astype(np.float32), saddles)


def test_no_other_place_matters() -> None:
    between = (-0.12, 0.1, 0.27, 0.425, 0.575, 0.73, 0.9, 1.12)
    picture = striped()
    for along in between:
        picture[:, round(20 + 40 * along)] = 100.0
    assert is_edge(picture.astype(np.float32), ends((20.0, 20.0), (60.0, 20.0)))


@pytest.mark.parametrize(("weaker", "is_one"), [(399.0, True), (401.0, False)])
def test_the_step_is_a_quarter_of_the_weaker_contrast_or_more(weaker: float, is_one: bool) -> None:
    picture = striped().astype(np.float32)
    assert is_edge(picture, ends((20.0, 20.0), (60.0, 20.0), weaker, 900.0)) is is_one
    assert is_edge(picture, ends((20.0, 20.0), (60.0, 20.0), 900.0, weaker)) is is_one


@pytest.mark.parametrize(("length", "seen"), [(10.0, 40.0), (40.0, 100.0)])
def test_it_is_looked_at_six_hundredths_beside_and_a_pixel_at_least(
    length: float, seen: float
) -> None:
    """Grey rises from nothing at one pixel beside the edge to all at two."""
    picture = np.full((90, 80), 100.0, np.float32)
    side = np.where((np.arange(80) > 20) & (np.arange(80) < 20 + length), 50.0, -50.0)
    picture[22:] += side.astype(np.float32)
    picture[:19] -= side.astype(np.float32)
    # At 1.2 px a fifth of the step is seen on either side; at 2.4 px all of it.
    step = seen / 2 if length == 10.0 else seen
    for share, is_one in ((0.98, True), (1.02, False)):
        saddles = ends((20.0, 20.0), (20.0 + length, 20.0), 4 * share * step, 900.0)
        assert is_edge(picture, saddles) is is_one


def test_each_link_is_judged_by_itself_anywhere_in_the_picture() -> None:
    """Corners of a board farther right than the picture is high, and one diagonal."""
    y, x = np.mgrid[:60, :200]
    picture = np.where((x // 20 + y // 20) % 2 == 0, 160.0, 60.0).astype(np.float32)
    xy_px = np.array([[159.5, 19.5], [179.5, 19.5], [159.5, 39.5], [179.5, 39.5]])
    saddles = Saddles(xy_px, np.zeros((4, 2, 2)), np.zeros((4, 2)), np.full(4, 100.0))
    first, last = np.array([0, 0, 0, 1, 2, 3]), np.array([1, 2, 3, 2, 3, 1])
    assert are_edges(picture, saddles, first, last).tolist() == [
        True, True, False, False, True, True,
    ]  # fmt: skip
    assert are_edges(picture, saddles, first[:0], last[:0]).shape == (0,)
