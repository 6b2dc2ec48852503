"""Frames and multi-views: their times, their scale, and that nobody writes into them."""

import numpy as np
import pytest

from rig.frames import Frame, MultiView


def frame(at_s: float = 5.0, **changes: float | int | None) -> Frame:
    kind = np.uint16 if changes.pop("wide", None) else np.uint8
    image = np.full((2, 3), round(at_s), kind)
    return Frame("a", image, at_s, 1, **changes)  # pyright: ignore[reportArgumentType]


def test_light_was_collected_from_half_an_exposure_before_the_earliest_middle() -> None:
    assert frame().began_s == 5.0
    assert frame(exposure_s=0.5).began_s == 4.75
    assert frame(uncertainty_s=0.25).began_s == 4.75
    assert frame(exposure_s=0.5, uncertainty_s=0.25).began_s == 4.5
    assert frame().uncertainty_s == 0.0


@pytest.mark.parametrize(
    ("changes", "full"),
    [({}, 255), ({"bits": 7}, 127), ({"wide": 1}, 65535), ({"wide": 1, "bits": 10}, 1023)],
)
def test_a_saturated_pixel_has_all_bits(changes: dict[str, int], full: int) -> None:
    assert frame(**changes).full_scale == full


def test_nobody_writes_into_a_frame() -> None:
    image = np.zeros((2, 3), np.uint8)
    taken = Frame("a", image, 0.0, 1)
    with pytest.raises(ValueError, match="read-only"):
        taken.image[0, 0] = 1
    image[0, 0] = 7
    assert taken.image[0, 0] == 7


def test_nobody_writes_into_the_colour_of_a_frame() -> None:
    colour = np.zeros((2, 3, 3), np.uint8)
    taken = Frame("a", np.zeros((2, 3), np.uint8), 0.0, 1, colour=colour)
    assert taken.colour is not None
    with pytest.raises(ValueError, match="read-only"):
        taken.colour[0, 0] = 1
    colour[0, 0] = 7
    assert taken.colour[0, 0].tolist() == [7, 7, 7]
    assert frame().colour is None


def test_a_multi_view_has_a_mean_time_and_a_skew() -> None:
    taken = MultiView((frame(3.0), frame(1.0), frame(8.0)))
    assert taken.timestamp_s == 4.0
    assert taken.skew_s == 7.0
    assert MultiView((frame(3.0),)).skew_s == 0.0


def test_a_multi_view_keeps_every_picture_at_its_own_size() -> None:
    pictures = (np.zeros((4, 6), np.uint8), np.ones((6, 4), np.uint16))
    taken = MultiView(tuple(Frame("a", one, 0.0, 1) for one in pictures))
    assert [(one.shape, one.dtype) for one in taken.images] == [
        ((4, 6), np.dtype(np.uint8)),
        ((6, 4), np.dtype(np.uint16)),
    ]
    assert np.shares_memory(taken.images[1], pictures[1])
