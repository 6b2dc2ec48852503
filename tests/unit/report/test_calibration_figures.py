"""Figures of a calibration: where panels and lines lie, from cameras that are known."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from rig.calibrate.guide import enough
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.report.calibration import space_plots, view_panels
from rig.report.calibration.shown import ShownCalibration
from rig.report.figures import Axes, draw_svg
from rig.report.page import flat_fields
from rig.report.times import times_text
from rig.sweep.take import SweepTimes


def shown(views: int, **changes: Any) -> ShownCalibration:
    cameras = tuple(
        CameraModel(640, 400 + 20 * n, 500.0, 400.0, 319.5, 199.5, "none", ()) for n in range(views)
    )
    poses = tuple(Pose(np.eye(3), np.array([-40.0 * n, 0.0, 0.0])) for n in range(views))
    geometry = SimpleNamespace(
        names=tuple("abcdefg"[:views]), cameras=cameras, cam_from_reference=poses, reference=0
    )
    plain: dict[str, Any] = {
        "geometry": geometry,
        "points_mm": np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [0.0, 60.0, 0.0]]),
        "reference_from_board": (Pose(np.eye(3), np.array([0.0, 0.0, 500.0])),),
        "pictures": tuple(range(10)),
    }
    calibration: Any = SimpleNamespace(**(plain | changes))
    return ShownCalibration("bench", calibration)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Every figure that is drawn, as it is before it becomes text."""
    kept: list[Figure] = []

    def keep(name: str, description: str, height_in: float, draw: Callable[[Figure], None]) -> str:
        def draw_and_keep(figure: Figure) -> None:
            draw(figure)
            kept.append(figure)

        return draw_svg(name, description, height_in, draw_and_keep)

    for module in (view_panels, space_plots):
        monkeypatch.setattr(module, "draw_svg", keep)
    return kept


@pytest.mark.parametrize(("views", "rows", "columns"), [(2, 1, 2), (3, 1, 3), (4, 2, 3), (7, 3, 3)])
def test_every_view_has_a_panel_in_its_pixels(
    drawn: list[Figure], views: int, rows: int, columns: int
) -> None:
    seen: list[int] = []

    def draw_view(_: Axes, view: int) -> None:
        seen.append(view)

    view_panels.draw_views("it", "it", shown(views), draw_view)
    (figure,) = drawn
    assert seen == list(range(views))
    assert len(figure.axes) == rows * columns
    across_in = (7.4 - (columns + 1) * 0.06 - 0.3) / columns
    tallest = (400 + 20 * (views - 1)) / 640
    assert figure.get_size_inches()[1] == pytest.approx(rows * (across_in * tallest + 0.48))
    for view, axes in enumerate(figure.axes):
        assert axes.axison == (view < views)
        if view >= views:
            continue
        assert axes.get_title(loc="left") == "abcdefg"[view]
        assert axes.get_xlim() == (-0.5, 639.5)
        assert axes.get_ylim() == (400 + 20 * view - 0.5, -0.5)
        assert axes.get_aspect() == 1.0
        assert list(axes.get_xticks()) == list(axes.get_yticks()) == []
        assert all(spine.get_visible() for spine in axes.spines.values())


def lines_of(axes: Any) -> list[np.ndarray]:
    """Every line of a panel as (N, 3): x, y, z with y down again."""
    found = [np.stack(line.get_data_3d(), axis=1) for line in axes.lines]
    return [np.stack([one[:, 0], -one[:, 2], one[:, 1]], axis=1) for one in found]


def test_cameras_and_boards_stand_where_they_stood(drawn: list[Figure]) -> None:
    space_plots.space_figure(shown(2))
    (figure,) = drawn
    assert figure.get_size_inches() == pytest.approx((7.4, 7.4 * 0.46))
    left, right = figure.axes
    board, first, second = lines_of(left)
    outline = np.array([[0, 0, 0], [100, 0, 0], [100, 60, 0], [0, 60, 0], [0, 0, 0]], float)
    assert board == pytest.approx(outline + np.array([0.0, 0.0, 500.0]))
    # 0.12 of 500 mm long; its corners are those of 640 x 400 px at f = 500 and 400 px.
    wide, high = 60.0 * 320.0 / 500.0, 60.0 * 200.0 / 400.0
    a, b = (-wide, -high, 60.0), (wide, -high, 60.0)
    c, d = (wide, high, 60.0), (-wide, high, 60.0)
    apex = (0.0, 0.0, 0.0)
    assert first == pytest.approx(np.array([apex, a, b, apex, c, b, c, d, apex, a, d]))
    assert second[0] == pytest.approx([40.0, 0.0, 0.0])
    assert second[1] == pytest.approx([40.0 - wide, -high, 60.0])
    board_alone, seen_first, seen_second = lines_of(right)
    assert board_alone == pytest.approx(outline)
    assert seen_first == pytest.approx(first - (0.0, 0.0, 500.0))
    assert seen_second == pytest.approx(second - (0.0, 0.0, 500.0))
    colours = [[line.get_color() for line in axes.lines] for axes in (left, right)]
    assert colours == [["#1a1a1a", "#d55e00", "#0072b2"]] * 2


def test_six_views_begin_the_colours_again(drawn: list[Figure]) -> None:
    space_plots.space_figure(shown(6))
    colours = [line.get_color() for line in drawn[0].axes[0].lines[1:]]
    assert colours[5] == colours[0]
    assert len(set(colours)) == 5
    assert [line.get_color() for line in drawn[0].axes[1].lines[1:]] == colours


@pytest.mark.parametrize(
    ("at_hand", "chosen"),
    [((), ()), ((3, 1), (1, 3)), ((0, 4, 9), (0, 4, 9)), ((0, 1, 2, 3, 8), (0, 2, 8))],
)
def test_first_middle_and_last_of_the_pictures_are_shown(
    at_hand: tuple[int, ...], chosen: tuple[int, ...]
) -> None:
    grey = np.zeros((2, 2), np.uint8)
    calibration = shown(2).calibration
    page = ShownCalibration("bench", calibration, {(n, 1): grey for n in at_hand})
    assert page.shown_pictures == chosen


def solved(*percents: float, good: bool = True) -> list[Any]:
    """Solves with these depth errors at 1 m, and others at other distances."""
    other = SimpleNamespace(picture_pct=50.0)
    return [
        SimpleNamespace(
            verdict=SimpleNamespace(good=good),
            depth_error=(other, SimpleNamespace(picture_pct=percent), other),
        )
        for percent in percents
    ]


@pytest.mark.parametrize(
    ("percents", "is_enough"),
    [
        ((0.5,), False),
        ((1.0, 0.92), True),
        ((1.0, 0.88), False),
        ((9.0, 1.0, 0.92), True),
        ((0.92, 1.0), True),
        ((0.0, 0.0), True),
        ((1.0, float("nan")), False),
        ((1.0, float("inf")), False),
    ],
)
def test_two_solves_that_hardly_differ_are_enough(
    percents: tuple[float, ...], is_enough: bool
) -> None:
    assert enough(solved(*percents)) == is_enough
    assert not enough(solved(*percents, good=False))


def test_nested_values_become_dotted_lines() -> None:
    assert flat_fields({"a": {"b": {"c": 1}, "d": "x"}, "e": None}) == [
        ("a.b.c", "1"), ("a.d", "x"), ("e", "not known"),
    ]  # fmt: skip


def test_the_time_of_a_sweep_is_told_with_its_ratio() -> None:
    times = SweepTimes(moves_s=10.0, settling_s=2.5, exposures_s=7.5)
    parts = "moves 10.0 s + settling 2.5 s + exposures 7.5 s = 20.0 s"
    assert times_text(times) == parts
    real: Any = SimpleNamespace(
        moves_s=10.0, settling_s=2.5, exposures_s=7.5, needed_s=20.0, is_simulated=False,
        total_s=25.0,
    )  # fmt: skip
    assert times_text(real) == f"{parts}; the sweep took 25.0 s (1.25 times)"
    real.is_simulated = True
    assert times_text(real) == f"{parts} of simulated time"
    real.is_simulated, real.needed_s = False, 0.0
    assert times_text(real).endswith("= 0.0 s")
