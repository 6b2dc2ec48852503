import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.compare import pair
from rig.compare.pair import best_pair
from rig.epipolar import RectifiedViews
from rig.errors import SlopeError


def views_at(*places: tuple[float, float], dtype: str = "uint8") -> RectifiedViews:
    """The reference view and views at these places, every pixel of all of them different."""
    shape = (len(places) + 1, 4, 6)
    images = np.arange(np.prod(shape)).reshape(shape).astype(dtype)
    x, y = np.array([(0.0, 0.0), *places]).T
    return RectifiedViews(images, x, y, 0)


def test_the_longest_baseline_in_row_or_column_wins():
    pair = best_pair(views_at((-1.06, 0.0), (0.93, 0.0), (0.0, -0.95), (0.0, 1.08)))
    assert pair.partner == 4
    assert pair.baseline_steps == 1.08


def test_a_view_off_both_axes_is_no_partner():
    assert best_pair(views_at((0.7, 0.0), (2.0, 2.0))).partner == 1
    with pytest.raises(SlopeError, match="none of 1 views lies in the row or column"):
        best_pair(views_at((1.0, 1.0)))


@pytest.mark.parametrize("place", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_turning_an_image_and_its_map_back_changes_nothing(place: tuple[float, float]):
    views = views_at(place)
    pair = best_pair(views)
    upright = pair.slope_px(pair.left.astype(np.float32))
    np.testing.assert_array_equal(upright, views.images[0])
    assert pair.left.shape == ((6, 4) if place[0] == 0.0 else (4, 6))


@given(
    low_px=st.floats(-40.0, 40.0),
    span_px=st.floats(0.01, 60.0),
    baseline=st.floats(0.1, 8.0),
)
@settings(deadline=None, max_examples=100)
def test_disparities_cover_the_slopes_in_whole_blocks(
    low_px: float, span_px: float, baseline: float
):
    pair = best_pair(views_at((baseline, 0.0)))
    first, count = pair.disparities((low_px, low_px + span_px))
    below, above = low_px * baseline - first, first + count - 1 - (low_px + span_px) * baseline
    assert count % 16 == 0
    assert min(below, above) > -1e-9
    assert below + above < 16 + 1
    assert abs(below - above) < 3


def test_deeper_images_are_stretched_alike():
    for dtype in ("uint16", "float32"):
        pair = best_pair(views_at((1.0, 0.0), dtype=dtype))
        assert (pair.left.min(), pair.right.max()) == (0, 255)
        assert int(pair.right.min()) - int(pair.left.max()) in (5, 6)


def test_deeper_pictures_are_stretched_by_what_both_of_them_hold():
    left, right = np.array([[100, 200]], np.uint16), np.array([[150, 356]], np.uint16)
    one, other = pair._eight_bit(left, right)
    assert one.tolist() == [[0, 100]]
    assert other.tolist() == [[50, 255]]
    assert pair._eight_bit(right, left)[0].tolist() == [[50, 255]]
    eight = np.array([[3, 9]], np.uint8)
    assert pair._eight_bit(eight, eight)[0].tolist() == [[3, 9]]
