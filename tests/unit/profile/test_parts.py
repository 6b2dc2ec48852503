"""Which pixels of a picture are which view's."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from rig_drivers.split import cut

from rig.profile import PartConfig, Region, V4l2CameraConfig, regions_in
from rig.profile.parts import layouts, likely_layout, picture_of, places_of


def part(value: object) -> PartConfig:
    return PartConfig.model_validate(value)


def camera(parts: dict[str, object], **values: object) -> V4l2CameraConfig:
    given: dict[str, Any] = {
        "kind": "v4l2",
        "devices": dict.fromkeys(("left", "right"), "/dev/one"),
        "width_px": 640,
        "height_px": 200,
        "rate_hz": 30,
        "pixel_format": "GREY",
        "parts": parts,
    }
    return V4l2CameraConfig.model_validate({**given, **values})


@pytest.mark.parametrize(
    ("shorthand", "region"),
    [
        ("side-by-side:1", Region(0, 0, 320, 200)),
        ("side-by-side:2", Region(320, 0, 320, 200)),
        ("four-side-by-side:3", Region(320, 0, 160, 200)),
        ("top-bottom:2", Region(0, 100, 640, 100)),
        ("two-by-two:2", Region(320, 0, 320, 100)),
        ("two-by-two:3", Region(0, 100, 320, 100)),
        ("interleaved:1", Region(0, 0, 320, 200, 2)),
        ("interleaved:2", Region(1, 0, 320, 200, 2)),
        ("whole:1", Region(0, 0, 640, 200)),
    ],
)
def test_a_place_of_a_layout_has_these_pixels(shorthand: str, region: Region):
    assert part(shorthand).region((640, 200)) == region


def test_a_rectangle_counts_within_its_place():
    second = {"layout": "two-by-two", "place": 4, "x_px": 10, "y_px": 4, "width_px": 300}
    assert part(second).region((640, 200)) == Region(330, 104, 300, 96)
    crop = {"layout": "interleaved", "place": 2, "x_px": 5, "width_px": 100, "height_px": 50}
    assert part(crop).region((640, 200)) == Region(11, 0, 100, 50, 2)
    assert part({"x_px": 600, "width_px": 40}).region((640, 200)) == Region(600, 0, 40, 200)


@given(
    layout=st.sampled_from(layouts()),
    width_px=st.integers(16, 60),
    height_px=st.integers(16, 60),
)
def test_the_places_of_a_layout_are_the_picture_taken_apart(
    layout: str, width_px: int, height_px: int
):
    whole_px = picture_of(layout, (width_px, height_px))
    picture = np.arange(whole_px[0] * whole_px[1], dtype=np.uint16).reshape(whole_px[::-1])
    parts = {str(place): part(f"{layout}:{place}") for place in range(1, places_of(layout) + 1)}
    views = [cut(picture, region) for region in regions_in(parts, whole_px).values()]
    assert all(view.shape == (height_px, width_px) for view in views)
    assert np.array_equal(np.sort(np.concatenate(views, axis=None)), np.arange(picture.size))


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        (
            {"left": "side-by-side:1", "right": {"x_px": 300, "width_px": 320}},
            r"parts\.left and parts\.right overlap in 20 x 200 px: 320 x 200 px \(x 0\.\.319, "
            r"y 0\.\.199\) and 320 x 200 px \(x 300\.\.619",
        ),
        (
            {"left": "side-by-side:1", "right": {"x_px": 330, "width_px": 320}},
            r"parts\.right: asked for x 330\.\.649, y 0\.\.199, the picture has 640 x 200 px",
        ),
        ({"left": "side-by-side:1"}, r"devices names /dev/one for 2 views.*where right lies"),
        ({"middle": "whole:1"}, "parts names no view: middle"),
        ({"left": "side-by-side:3"}, "side-by-side has places 1 to 2, found 3"),
        ({"left": "beside:1"}, "'beside:1' is no part of a picture.*two-by-two, interleaved"),
        ({"left": "side-by-side"}, "LAYOUT:PLACE"),
        ({"left": "side-by-side:0"}, "greater than or equal to 1"),
    ],
)
def test_parts_that_make_no_views_are_refused_with_numbers(parts: dict[str, object], told: str):
    with pytest.raises(ValidationError, match=told):
        camera(parts)


def test_a_picture_that_has_no_equal_places_is_refused():
    with pytest.raises(ValidationError, match=r"2 x 1 equal places, found 641 x 200 px"):
        camera({"left": "side-by-side:1", "right": "side-by-side:2"}, width_px=641)


def test_formats_that_hold_two_views_in_turn_are_twice_as_wide_and_need_that_layout():
    config = camera({"left": "interleaved:1", "right": "interleaved:2"}, pixel_format="Y8I")
    assert config.picture_px == (1280, 200)
    assert config.size_px == (640, 200)
    assert config.regions["right"] == Region(1, 0, 640, 200, 2)
    with pytest.raises(ValidationError, match=r"Y8I holds .* in turn.*layout interleaved for left"):
        camera({"left": "side-by-side:1", "right": "interleaved:2"}, pixel_format="Y8I")


def test_views_of_one_device_are_in_one_picture_and_told_one_thing():
    halves: dict[str, object] = {"left": "side-by-side:1", "right": "side-by-side:2"}
    config = camera(halves, view_controls={"left": {"gain": 3}, "right": {"hue": 1}})
    assert config.is_one_picture
    assert config.controls_of("left") == {"gain": 3, "hue": 1}
    with pytest.raises(ValidationError, match=r"view_controls\.gain is 3 and 4 .* /dev/one"):
        camera(halves, view_controls={"left": {"gain": 3}, "right": {"gain": 4}})
    apart = camera({}, devices={"left": "/dev/one", "right": "/dev/two"})
    assert not apart.is_one_picture
    assert apart.size_px == (640, 200)


@pytest.mark.parametrize(
    ("picture_px", "layout"),
    [
        ((1280, 720), None),
        ((1280, 1024), None),
        ((2560, 1080), None),  # one very wide sensor
        ((2560, 720), "side-by-side"),
        ((1280, 480), "side-by-side"),
        ((5120, 800), "four-side-by-side"),
        ((1280, 1440), "top-bottom"),
        (None, None),
    ],
)
def test_the_shape_of_a_picture_suggests_a_layout(
    picture_px: tuple[int, int] | None, layout: str | None
):
    assert likely_layout(picture_px, ("YUYV",)) == layout
    assert likely_layout(picture_px, ("YUYV", "Y12I")) == "interleaved"


def test_a_part_is_short_or_a_table_in_the_schema_too():
    schema = PartConfig.model_json_schema()
    short, table = schema["anyOf"]
    assert short["type"] == "string"
    assert set(table["properties"]) == {
        "layout", "place", "x_px", "y_px", "width_px", "height_px",
    }  # fmt: skip
