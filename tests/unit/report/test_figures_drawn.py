"""What the figures show, number by number, as they are before they become text."""

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.colors import to_hex
from matplotlib.container import BarContainer, ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver

from rig.curve import depth_errors
from rig.epipolar import Label
from rig.geometry.camera_model import CameraModel
from rig.report import curve_plots, epi_plots, figures, stop_plots
from rig.report.calibration import corner_plots, error_plots, field_plots, view_panels
from rig.report.calibration.shown import ShownCalibration
from rig.report.epi import EdgeLine, Epi
from rig.report.evidence import gather
from rig.report.scatter import deviations, direction_pairs, estimator_gaps, mm_per_px
from tests.unit.report.conftest import Reported

MODULES = (
    curve_plots, stop_plots, epi_plots, error_plots, field_plots, corner_plots, view_panels,
)  # fmt: skip


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Every figure; what matplotlib says of the types of their parts is too wide to be of use."""
    kept: list[Any] = []

    def keep(_: str, __: str, height_in: float, draw: Callable[[Figure], None]) -> str:
        with rc_context(figures._STYLE):
            figure = Figure(figsize=(figures.WIDTH_IN, height_in))
            draw(figure)
        kept.append(figure)
        return "<svg/>"

    for module in MODULES:
        monkeypatch.setattr(module, "draw_svg", keep)
    return kept


def data(line: Any) -> np.ndarray:
    return np.stack([np.asarray(one, float) for one in line.get_data()], axis=-1)


def height_in(figure: Figure) -> float:
    return float(figure.get_size_inches()[1])


def by_kind(points: Any, values: Any) -> list[np.ndarray]:
    """Stops in the order in which their kinds are plotted."""
    kinds = [
        ("fit", "forward"),
        ("fit", "backward"),
        ("holdout", "forward"),
        ("holdout", "backward"),
    ]
    found = []
    for kind in kinds:
        chosen = [
            (p.distance_mm, v) for p, v in zip(points, values, strict=True)
            if (p.role, p.direction) == kind
        ]  # fmt: skip
        if chosen:
            found.append(np.array(chosen))
    return found


def assert_plotted(lines: Any, expected: list[np.ndarray]) -> None:
    assert len(lines) == len(expected)
    for line, wanted in zip(lines, expected, strict=True):
        assert data(line) == pytest.approx(wanted)


def test_the_curve_is_drawn_over_its_range_with_all_stops(good: Reported, drawn: list[Any]):
    fit = good.result.fit
    points = tuple(s.point for s in good.result.stops if s.point is not None)
    curve_plots.slope_figure(fit, points)
    (axes,) = drawn[0].axes
    assert height_in(drawn[0]) == 3.9
    zero, curve, *others = axes.get_lines()
    assert list(zero.get_ydata()) == [0.0, 0.0]
    near, far = fit.best.valid_mm
    told = data(curve)
    assert len(told) == 400
    assert (told[0, 0], told[-1, 0]) == pytest.approx((near, far))
    assert told[:, 1] == pytest.approx(fit.best.slope_px(told[:, 0]))
    for law, line in zip(fit.laws, others, strict=False):
        ends = np.array(law.distances_mm)
        wanted = np.stack([ends, law.px_per_mm * (ends - law.zero_mm)], axis=1)
        assert data(line) == pytest.approx(wanted)
        assert to_hex(line.get_color()) == ("#e69f00" if law.side == "before" else "#009e73")
        assert (line.get_linewidth() == 2.6) == (law.scope == "holds")
    kinds = by_kind(points, [p.slope_px for p in points])
    assert_plotted(others[len(fit.laws) : len(fit.laws) + len(kinds)], kinds)
    focus = others[-1]
    assert list(focus.get_xdata()) == [fit.best.focus_mm] * 2
    room = 0.06 * np.ptp(told[:, 1])
    assert axes.get_ylim() == pytest.approx((told[:, 1].min() - room, told[:, 1].max() + room))


def test_residuals_of_every_model_stand_about_zero(good: Reported, drawn: list[Any]):
    fit = good.result.fit
    curve_plots.residual_figure(fit)
    figure = drawn[0]
    assert height_in(figure) == pytest.approx(0.8 + 1.3 * len(fit.candidates))
    assert len(figure.axes) == 2 * len(fit.candidates)
    for k, candidate in enumerate(fit.candidates):
        left, right = figure.axes[2 * k : 2 * k + 2]
        points = [r.point for r in candidate.residuals]
        for axes, values in (
            (left, [r.error_px for r in candidate.residuals]),
            (right, [r.error_pct for r in candidate.residuals]),
        ):
            *stops, zero = axes.get_lines()
            assert_plotted(stops, by_kind(points, values))
            assert list(zero.get_ydata()) == [0.0, 0.0]
            low, high = axes.get_ylim()
            assert low == -high
            most = max(abs(v) for v in values)
            assert 1.1 * most <= high <= 1.35 * most
        chosen = candidate.curve.model == fit.best.model
        assert left.get_title(loc="left") == candidate.curve.model + (" (chosen)" if chosen else "")
        is_last = k == len(fit.candidates) - 1
        assert (left.get_xlabel() == right.get_xlabel() == curve_plots.DISTANCE) == is_last


def test_held_out_errors_lie_in_the_band_of_the_headline(good: Reported, drawn: list[Any]):
    fit = good.result.fit
    assert fit.holdout is not None
    curve_plots.holdout_figure(fit, fit.holdout, 0.3)
    figure = drawn[0]
    left, right = figure.axes
    assert height_in(figure) == 2.8
    at_mm = np.linspace(*fit.best.valid_mm, 200)
    band = np.array([e.expanded_mm for e in depth_errors(fit.best, fit.holdout, at_mm.tolist())])
    for axes, wanted in ((left, band), (right, 100 * band / at_mm)):
        (area,) = axes.collections
        corners = area.get_paths()[0].vertices
        assert np.max(corners[:, 1]) == pytest.approx(wanted.max())
        assert np.min(corners[:, 1]) == pytest.approx(-wanted.max())
        assert (corners[:, 0].min(), corners[:, 0].max()) == pytest.approx((at_mm[0], at_mm[-1]))
        inside = np.isin(corners[:, 0].round(6), at_mm.round(6))
        assert np.abs(corners[inside, 1]).max() == pytest.approx(wanted.max())
    points = [r.point for r in fit.holdout.residuals]
    kinds = by_kind(points, [r.error_mm for r in fit.holdout.residuals])
    assert_plotted(left.get_lines()[1:], kinds)
    percent = by_kind(points, [r.error_pct for r in fit.holdout.residuals])
    lines = right.get_lines()
    assert_plotted(lines[1 : 1 + len(kinds)], percent)
    gates = lines[1 + len(kinds) :]
    assert [list(line.get_ydata()) for line in gates] == [[-0.3, -0.3], [0.3, 0.3]]
    assert [line.get_label() for line in gates][1] == "gate, 0.3 %"
    assert gates[0].get_label().startswith("_")


def test_scatter_direction_and_stillness_of_every_stop(good: Reported, drawn: list[Any]):
    evidence = gather(good.store, good.result)
    stops, curve = good.result.stops, good.result.fit.best
    stop_plots.repeat_figure(evidence)
    figure = drawn[0]
    samples, scatter, directions, motion = figure.axes
    assert height_in(figure) == 4.6
    found = deviations(stops, evidence.samples, evidence.measurements)
    *each, zero = samples.get_lines()
    assert_plotted(each, by_kind([d.point for d in found], [1000 * d.error_px for d in found]))
    assert list(zero.get_ydata()) == [0.0, 0.0]
    assert all(line.get_markersize() == 3.2 for line in each)
    points = [s.point for s in stops if s.point is not None]
    wanted = [p.std_px * abs(mm_per_px(curve, p.distance_mm)) for p in points]
    assert_plotted(scatter.get_lines(), by_kind(points, wanted))
    assert scatter.get_ylim()[0] == 0.0
    pairs = direction_pairs(stops, curve)
    (bars,) = (c for c in directions.containers if isinstance(c, ErrorbarContainer))
    assert data(bars.lines[0]) == pytest.approx(
        np.array([[p.distance_mm, p.difference_mm] for p in pairs])
    )
    lengths = [np.ptp(part[:, 1]) for part in bars.lines[2][0].get_segments()]
    assert lengths == pytest.approx([2 * p.expanded_mm for p in pairs])
    forward, backward, limit = motion.get_lines()
    for line, way in ((forward, "forward"), (backward, "backward")):
        moved = [
            (s.stop.distance_mm, s.motion_px) for s in stops
            if s.motion_px is not None and s.stop.direction == way
        ]  # fmt: skip
        assert data(line) == pytest.approx(np.array(moved, float))
    at_px = float(limit.get_ydata()[0])
    most = max(at_px, *(s.motion_px for s in stops if s.motion_px is not None))
    assert motion.get_ylim() == pytest.approx((0.0, 1.25 * most))
    places = [s.stop.distance_mm for s in stops]
    room = 0.05 * (max(places) - min(places))
    assert motion.get_xlim() == pytest.approx((min(places) - room, max(places) + room))
    assert directions.get_xlabel() == motion.get_xlabel() == curve_plots.DISTANCE


def test_panels_without_numbers_say_why(least: Reported, drawn: list[Any]):
    stop_plots.repeat_figure(gather(least.store, least.result))
    said = [[text.get_text() for text in axes.texts] for axes in drawn[0].axes]
    assert [len(one) for one in said] == [1, 1, 1, 1]
    assert "no scatter" in said[0][0]
    assert "no scatter" in said[1][0]
    assert "both directions" in said[2][0]
    assert "not proven" in said[3][0]
    for axes in drawn[0].axes:
        assert axes.texts[0].get_position() == (0.5, 0.5)
        assert len(axes.get_yticks()) == 0
        assert not axes.get_lines()


def test_estimators_are_compared_as_slope_and_as_depth(good: Reported, drawn: list[Any]):
    gaps = estimator_gaps(good.result.stops, good.result.fit.best, 0.3)
    stop_plots.estimator_figure(gaps, 0.3)
    left, right = drawn[0].axes
    corners = left.collections[0].get_paths()[0].vertices
    limits = [gap.limit_px for gap in gaps]
    assert (corners[:, 1].min(), corners[:, 1].max()) == pytest.approx((-max(limits), max(limits)))
    band = right.patches[0].get_bbox()
    assert (band.y0, band.y1) == pytest.approx((-0.3, 0.3))
    for k, name in enumerate(("corner_px", "dense_px")):
        told = [(g, getattr(g, name)) for g in gaps if getattr(g, name) is not None]
        wanted = np.array([(g.point.distance_mm, value) for g, value in told]).reshape(-1, 2)
        assert data(left.get_lines()[k]).reshape(-1, 2) == pytest.approx(wanted)
        wanted[:, 1] *= [g.pct_per_px for g, _ in told]
        assert data(right.get_lines()[k]).reshape(-1, 2) == pytest.approx(wanted)
    for axes in (left, right):
        assert list(axes.get_lines()[2].get_ydata()) == [0.0, 0.0]


def test_a_temperature_is_drawn_from_a_tenth_of_a_degree(good: Reported, drawn: list[Any]):
    sample = good.store.samples(good.result.sweep_id)[0]

    def at(minutes: float, degc: float | None) -> Any:
        return replace(
            sample, taken_at=sample.taken_at + timedelta(minutes=minutes), temperature_degc=degc
        )

    assert stop_plots.temperature_figure([at(0, 20.0), at(1, 20.09)]) is None
    assert stop_plots.temperature_figure([at(0, None)]) is None
    assert not drawn
    svg = stop_plots.temperature_figure([at(0, 20.0), at(2, None), at(5, 19.5), at(8.5, 20.11)])
    assert svg is not None
    (line,) = drawn[0].axes[0].get_lines()
    assert data(line) == pytest.approx(np.array([[0, 20.0], [5, 19.5], [8.5, 20.11]]))


def test_epis_lie_between_their_views(drawn: list[Any]):
    grey = np.tile(np.arange(11, dtype=np.float32), (3, 1))
    edges = (
        EdgeLine(105.0, 2.0, Label.BEYOND), EdgeLine(103.0, -1.0, Label.NEARER),
        EdgeLine(107.0, 0.5, Label.NEARER),
    )  # fmt: skip
    epi = Epi("H", 44, (-1.0, 0.0, 1.5), grey, 100, edges)
    epi_plots.epi_figure([(700.0, [epi]), (900.0, [replace(epi, kind="V")])])
    figure = drawn[0]
    assert height_in(figure) == pytest.approx(0.4 + 1.75 * 2)
    first, empty, _, second = figure.axes
    assert not empty.axison
    assert first.get_title(loc="left") == "H, 700.0 mm, row v = 44 px"
    assert second.get_title(loc="left") == "V, 900.0 mm, column u = 44 px"
    high = 0.62 * 1.0
    for image, step in zip(first.get_images(), epi.steps, strict=True):
        assert image.get_extent() == pytest.approx((99.5, 110.5, step - high / 2, step + high / 2))
    ends = (-1.0 - 0.6 * high, 1.5 + 0.6 * high)
    assert first.get_ylim() == pytest.approx(ends)
    assert first.get_xlim() == pytest.approx((99.5, 110.5))
    ordered = [edges[1], edges[2], edges[0]]
    for line, edge in zip(first.get_lines(), ordered, strict=True):
        assert list(line.get_ydata()) == pytest.approx(list(ends))
        assert list(line.get_xdata()) == pytest.approx(
            [edge.at_px - edge.slope_px * end for end in ends]
        )
    named = [not str(line.get_label()).startswith("_") for line in first.get_lines()]
    assert named == [True, False, True]
    assert [text.get_text() for text in first.get_yticklabels()] == ["-1.00", "0", "+1.50"]


def residuals(picture: int, view: int, lengths: list[float], outlier: int | None = None) -> Any:
    count = len(lengths)
    is_outlier = np.zeros(count, np.bool_)
    if outlier is not None:
        is_outlier[outlier] = True
    return SimpleNamespace(
        picture=picture, view=view, ids=np.arange(count), outlier=is_outlier,
        xy_px=np.stack([10.0 * np.arange(count) + picture, 20.0 * np.arange(count) + view], axis=1),
        residual_px=np.stack([0.6 * np.array(lengths), 0.8 * np.array(lengths)], axis=1),
        rms_px=float(np.mean(lengths)), held_out_rms_px=2.0 * float(np.mean(lengths)),
    )  # fmt: skip


def camera(**changes: Any) -> CameraModel:
    plain: dict[str, Any] = {
        "width_px": 640, "height_px": 400, "fx_px": 500.0, "fy_px": 400.0, "cx_px": 319.5,
        "cy_px": 199.5, "lens": "brown5", "coefficients": (0.1, 0.0, 0.0, 0.0, 0.0),
    }  # fmt: skip
    return CameraModel(**(plain | changes))


def shown_of(every: list[Any], pictures: tuple[int, ...], **changes: Any) -> ShownCalibration:
    geometry = SimpleNamespace(
        names=("left", "right"), cameras=(camera(), camera(coefficients=(0.0,) * 5)), reference=0,
        covariance=None,
    )  # fmt: skip
    calibration: Any = SimpleNamespace(
        geometry=geometry, residuals=tuple(every), pictures=pictures, rms_px=0.7
    )
    return ShownCalibration("bench", calibration, **changes)


def test_bars_stand_at_their_pictures(drawn: list[Any]):
    every = [
        residuals(4, 0, [1.0]), residuals(4, 1, [2.0]), residuals(7, 0, [3.0]),
        residuals(9, 1, [4.0], outlier=0), residuals(9, 0, [5.0, 7.0], outlier=0),
    ]  # fmt: skip
    error_plots.bar_figure(shown_of(every, (4, 7, 9)))
    (axes,) = drawn[0].axes
    left, right = (c for c in axes.containers if isinstance(c, BarContainer))
    middles = [[bar.get_x() + bar.get_width() / 2 for bar in bars] for bars in (left, right)]
    assert middles[0] == pytest.approx([-0.2, 0.8, 1.8])
    assert middles[1] == pytest.approx([0.2])
    assert [bar.get_height() for bar in left] == [1.0, 3.0, 6.0]
    assert left[0].get_width() == pytest.approx(0.4)
    dots_left, dots_right, whole = axes.get_lines()
    assert data(dots_left) == pytest.approx(np.array([[-0.2, 2], [0.8, 6], [1.8, 12]]))
    assert data(dots_right) == pytest.approx(np.array([[0.2, 4]]))
    assert dots_left.get_label() == "held out"
    assert dots_right.get_label() != "held out"
    assert list(whole.get_ydata()) == [0.7, 0.7]
    assert axes.get_xlim() == (-0.7, 3.0)
    assert [text.get_text() for text in axes.get_xticklabels()] == ["4", "7", "9"]


@pytest.mark.parametrize(("pictures", "every"), [(30, 1), (31, 2), (60, 2), (61, 3)])
def test_at_most_thirty_pictures_are_numbered(drawn: list[Any], pictures: int, every: int):
    error_plots.bar_figure(shown_of([residuals(0, 0, [1.0])], tuple(range(pictures))))
    assert list(drawn[0].axes[0].get_xticks()) == list(range(0, pictures, every))


def test_residuals_are_exaggerated_by_the_usual_one(drawn: list[Any]):
    lengths = [float(n) for n in range(1, 22)]
    every = [residuals(0, 0, [*lengths, 500.0], outlier=21)]
    error_plots.residual_figure(shown_of(every, (0,)))
    left = drawn[0].axes[0]
    zoom = 0.06 * 640 / float(np.quantile(lengths, 0.95))
    (arrows,) = (c for c in left.collections if isinstance(c, Quiver))
    assert np.asarray(arrows.U) == pytest.approx(0.6 * zoom * np.array(lengths))
    assert np.asarray(arrows.V) == pytest.approx(0.8 * zoom * np.array(lengths))
    assert arrows.scale == 1.0
    (cross,) = left.get_lines()
    assert data(cross) == pytest.approx(np.array([[210.0, 420.0]]))
    assert left.texts[0].get_text() == f"× {zoom:.0f}"


def test_every_found_point_counts_for_coverage(drawn: list[Any]):
    every = [residuals(0, 0, [1.0, 2.0], outlier=1), residuals(3, 0, [1.0])]
    error_plots.coverage_figure(shown_of(every, (0, 3)))
    first, second = drawn[0].axes[0].get_lines()
    assert data(first) == pytest.approx(np.array([[0, 0], [10, 20]]))
    assert data(second) == pytest.approx(np.array([[3, 0]]))


def test_lenses_are_drawn_as_what_they_shift(drawn: list[Any]):
    field_plots.distortion_figure(shown_of([], ()))
    bent, straight = drawn[0].axes
    (arrows,) = (c for c in bent.collections if isinstance(c, Quiver))
    x = np.linspace(0, 639, 33)[2::4]
    y = np.linspace(0, 399, 25)[2::4]
    columns, rows = np.meshgrid(x, y)
    assert np.asarray(arrows.X).ravel() == pytest.approx(columns.ravel())
    assert np.asarray(arrows.Y).ravel() == pytest.approx(rows.ravel())
    a, b = (columns - 319.5) / 500, (rows - 199.5) / 400
    by = 0.1 * (a * a + b * b)
    shift = np.stack([500 * a * by, 400 * b * by])
    zoom = 0.06 * 640 / np.abs(shift).max()
    assert np.asarray(arrows.U).ravel() == pytest.approx((zoom * shift[0]).ravel(), rel=1e-4)
    assert np.asarray(arrows.V).ravel() == pytest.approx((zoom * shift[1]).ravel(), rel=1e-4)
    assert f"arrows × {zoom:.1f}" in [text.get_text() for text in bent.texts]
    assert not straight.collections
    assert not straight.texts


def test_depth_errors_are_shown_in_per_cent_at_three_distances(
    drawn: list[Any], monkeypatch: pytest.MonkeyPatch
):
    asked: list[tuple[float, tuple[int, ...]]] = []

    def sigma(_: object, distance_mm: float, pixels: np.ndarray) -> np.ndarray:
        asked.append((distance_mm, pixels.shape))
        return 1e-3 * distance_mm * (1 + pixels[:, 0])

    monkeypatch.setattr(field_plots, "depth_sigma_mm", sigma)
    shown = shown_of([], ())
    assert field_plots.depth_sigma_figure(shown) is None
    shown.calibration.geometry.covariance = np.eye(3)  # pyright: ignore[reportAttributeAccessIssue]
    assert field_plots.depth_sigma_figure(shown) is not None
    assert asked == [(d, (33 * 25, 2)) for d in (500.0, 1000.0, 3000.0)]
    for axes, title in zip(drawn[0].axes, ("0.5 m", "1 m", "3 m"), strict=False):
        (image,) = axes.get_images()
        values = np.asarray(image.get_array())
        assert values.shape == (25, 33)
        assert values[0] == pytest.approx(0.2 * (1 + np.linspace(0, 639, 33)))
        assert image.get_clim() == pytest.approx((0.0, float(np.quantile(values, 0.95))))
        half = 0.5 * 639 / 32, 0.5 * 399 / 24
        assert image.get_extent() == pytest.approx(
            (-half[0], 639 + half[0], 399 + half[1], -half[1])
        )
        assert axes.get_title(loc="left") == f"{title}: k=2, % of depth"

    monkeypatch.setattr(field_plots, "depth_sigma_mm", lambda _, __, p: np.full(len(p), np.nan))
    assert field_plots.depth_sigma_figure(shown) is None


def test_found_and_reprojected_corners_are_marked_on_their_pictures(drawn: list[Any]):
    every = [residuals(1, 0, [1.0, 2.0, 3.0], outlier=2), residuals(1, 1, [1.0])]
    every[1].ids = np.array([5])
    grey = np.arange(400 * 640, dtype=np.uint8).reshape(400, 640)
    images = {(1, 0): grey, (2, 1): grey, (1, 1): grey}
    shown = shown_of(every, (1, 2), images=images)
    corner_plots.corner_figure(shown)
    figure = drawn[0]
    assert height_in(figure) == pytest.approx(0.24 + 2 * (0.24 + 7.4 / 2 * 400 / 640))
    first, other, missing, bare = figure.axes
    found, again, origin = first.get_lines()
    xy = every[0].xy_px
    assert data(found) == pytest.approx(xy)
    assert data(again) == pytest.approx((xy - every[0].residual_px)[:2])
    assert data(origin) == pytest.approx(xy[:1])
    assert len(other.get_lines()) == 2  # point 0 is not seen
    assert not missing.get_images()
    assert len(bare.get_images()) == 1
    assert not bare.get_lines()
    assert first.get_title(loc="left") == "picture 1, left"
    assert first.get_xlim() == (-0.5, 639.5)
    assert first.get_ylim() == (399.5, -0.5)
    assert not any(axes.axison for axes in figure.axes)
    assert corner_plots.corner_figure(shown_of(every, (1, 2))) is None
