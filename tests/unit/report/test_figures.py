"""Where the panels of a figure lie, in inches, and what photographs of boards show."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from rig.report import picture_plots
from rig.report.figures import draw_svg, legend_above, panels, show_grey
from rig.report.picture_plots import corner_figure, failure_figure
from tests.support.sweeps import SCENE, bench_profile
from tests.unit.report.test_epi import picture_of


def places_in(figure: Figure) -> list[list[float]]:
    """Left, bottom, width and height of every panel, inches."""
    width_in, height_in = figure.get_size_inches().tolist()
    return [
        [box.x0 * width_in, box.y0 * height_in, box.width * width_in, box.height * height_in]
        for box in (axes.get_position() for axes in figure.axes)
    ]


def test_panels_with_labels_leave_them_room() -> None:
    """0.7 in at the left, 0.06 at the right, 0.42 below, 0.78 between columns."""
    figure = Figure(figsize=(7.4, 4.0))
    grid = panels(figure, 2, 3, top_in=0.3, row_gap_in=0.5)
    assert (len(grid), len(grid[0])) == (2, 3)
    wide, high = (7.4 - 0.7 - 0.06 - 2 * 0.78) / 3, (4.0 - 0.3 - 0.42 - 0.5) / 2
    assert places_in(figure) == [
        pytest.approx([0.7 + column * (wide + 0.78), 0.42 + row * (high + 0.5), wide, high])
        for row in (1, 0)
        for column in range(3)
    ]


def test_panels_without_labels_come_close_to_each_other() -> None:
    figure = Figure(figsize=(7.4, 4.0))
    panels(figure, 1, 2, room_for_labels=False)
    wide = (7.4 - 2 * 0.06 - 0.15) / 2
    assert places_in(figure) == [
        pytest.approx([0.06 + column * (wide + 0.15), 0.06, wide, 4.0 - 0.1 - 0.06])
        for column in range(2)
    ]


def test_one_panel_is_the_rule_and_axes_are_shared_where_asked() -> None:
    assert [len(row) for row in panels(Figure(figsize=(7.4, 4.0)))] == [1]
    for share_x in (True, False):
        ((above,), (below,)) = panels(Figure(figsize=(7.4, 4.0)), 2, share_x=share_x)
        below.set_xlim(3.0, 5.0)
        assert (above.get_xlim() == (3.0, 5.0)) == share_x


def test_a_legend_names_each_label_once_in_the_corner_of_the_panels() -> None:
    figure = Figure(figsize=(7.4, 4.0))
    ((left, right),) = panels(figure, 1, 2)
    for axes in (left, right):
        axes.plot([0.0, 1.0], [0.0, 1.0], label="same")
    right.plot([0.0, 1.0], [1.0, 0.0], label="other")
    legend_above(figure, columns=2)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["same", "other"]
    corner = legend.get_bbox_to_anchor().transformed(figure.transFigure.inverted())
    assert (corner.x0, corner.y0) == pytest.approx((0.7 / 7.4, 1.0))


def test_a_drawing_is_one_element_with_ids_of_its_own() -> None:
    def draw(figure: Figure) -> None:
        ((axes,),) = panels(figure)
        show_grey(axes, np.arange(4.0).reshape(2, 2).astype(np.float32), extent=(0, 2, 0, 2))
        (image,) = axes.get_images()
        assert image.get_clim() == (0.0, 3.0)

    svg = draw_svg("mine", 'a "b" & c', 2.0, draw)
    assert svg.startswith('<svg role="img" aria-label="a &quot;b&quot; &amp; c"')
    assert svg.count("aria-label") == 1
    assert 'id="mine-figure_1"' in svg
    assert svg == draw_svg("mine", 'a "b" & c', 2.0, draw)
    assert f'height="{72.0 * 2.0:g}pt"' in svg
    assert f'width="{72.0 * 7.4:g}pt"' in svg


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Every figure that is drawn, kept as it is before it becomes text."""
    kept: list[Figure] = []

    def keep(name: str, description: str, height_in: float, draw: Callable[[Figure], None]) -> str:
        def draw_and_keep(figure: Figure) -> None:
            draw(figure)
            kept.append(figure)

        return draw_svg(name, description, height_in, draw_and_keep)

    monkeypatch.setattr(picture_plots, "draw_svg", keep)
    return kept


def test_corners_are_shown_in_the_whole_picture_and_in_its_middle(drawn: list[Figure]) -> None:
    profile = bench_profile()
    pictures = [
        picture_of(SCENE.with_changes(distance_mm=distance_mm), profile)
        for distance_mm in (500.0, 900.0)
    ]
    corner_figure(pictures, profile.reference)
    (figure,) = drawn
    rows, columns = pictures[0].images[profile.reference].shape
    assert figure.get_size_inches() == pytest.approx((7.4, 2 * (0.24 + 7.4 / 3 * rows / columns)))
    whole, middle = figure.axes[:3], figure.axes[3:]
    assert [axes.get_title(loc="left") for axes in whole] == ["500.0 mm", "900.0 mm", ""]
    for axes, close_up, picture in zip(whole, middle, pictures, strict=False):
        assert axes.get_xlim() == (-0.5, columns - 0.5)
        assert axes.get_ylim() == (rows - 0.5, -0.5)
        outline, corners = axes.lines
        assert np.asarray(outline.get_xydata()) == pytest.approx(
            np.concatenate([picture.outline_px, picture.outline_px[:1]])
        )
        assert np.asarray(corners.get_xydata()) == pytest.approx(picture.corners_px.reshape(-1, 2))
        # Half the height is 1.2 squares, in the shape of the picture.
        half_px = 1.2 * picture.square_px
        across, down = picture.centre_px
        wide_px = half_px * columns / rows
        assert close_up.get_xlim() == pytest.approx((across - wide_px, across + wide_px))
        assert close_up.get_ylim() == pytest.approx((down + half_px, down - half_px))
        told = f"middle, {round(2 * wide_px)} × {round(2 * half_px)} px"
        assert close_up.get_title(loc="left") == told
        (shown,) = close_up.get_images()
        left, right, bottom, top = shown.get_extent()
        part: Any = shown.get_array()
        u, v = round(left + 0.5), round(top + 0.5)
        assert part.shape == (round(bottom - top), round(right - left))
        image = picture.images[profile.reference]
        assert np.array_equal(part, image[v : v + part.shape[0], u : u + part.shape[1]])
        assert left <= across - wide_px < left + 1.5
        assert right - 2.0 < across + wide_px <= right
        assert top <= down - half_px < top + 1.5
        assert bottom - 2.0 < down + half_px <= bottom
    assert not whole[2].axison


def test_large_pictures_are_reduced_and_keep_their_coordinates(drawn: list[Figure]) -> None:
    profile = bench_profile()
    picture = picture_of(SCENE.with_changes(distance_mm=500.0), profile)

    class Failed:
        """A stop without a slope, with as large a picture as is wanted."""

        def __init__(self, width_px: int) -> None:
            self.image = np.tile(np.arange(width_px, dtype=np.uint16), (width_px // 2, 1))
            self.sample = picture.sample

    failures: Any = [Failed(640), Failed(1280)]
    failure_figure(failures)
    (figure,) = drawn
    assert figure.get_size_inches()[1] == pytest.approx(0.24 + 7.4 / 3 / 2)
    small, large, _ = figure.axes
    (whole,), (reduced,) = small.get_images(), large.get_images()
    assert np.asarray(whole.get_array()).shape == (320, 640)
    assert np.asarray(reduced.get_array()).shape == (320, 640)
    assert np.asarray(reduced.get_array())[0, :2] == pytest.approx([0.5, 2.5], abs=0.5)
    assert large.get_xlim() == (-0.5, 1279.5)
    assert large.get_ylim() == (639.5, -0.5)
    assert small.get_title(loc="left") == "500.0 mm"
