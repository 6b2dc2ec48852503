"""Rows that do not meet: measured, mended and named; nothing is named where they do."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews, SlopeMap, estimate_slopes
from rig.epipolar.mending import fitting
from rig.epipolar.mending.fitting import fit_together
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.search.window import window_of
from tests.support.lightfield import (
    Surface,
    disc,
    everywhere,
    expose,
    noise_texture,
    plane,
    true_slope_px,
)

Array = NDArray[np.float64]

SHAPE = (192, 240)
PLACES = np.array([[0.0, 0.0], [-1.04, 0.0], [0.97, 0.0], [0.0, -0.98], [0.0, 1.05]])
RANGE_PX = (-6.0, 7.0)
SURFACES = [
    Surface(
        plane(-4.0, 0.012, 0.01), noise_texture(4, mean=115, contrast=28, finest_px=2), everywhere
    ),
    Surface(
        plane(4.0), noise_texture(5, mean=140, contrast=28, finest_px=2), disc((140.0, 80.0), 45.0)
    ),
]


@dataclass(frozen=True)
class Bend:
    """Offsets of a picture across its line: a polynomial of the second degree, px."""

    level: float = 0.0
    right: float = 0.0
    down: float = 0.0
    curve: float = 0.0

    def __call__(self, x: Array, y: Array) -> Array:
        s, t = 2.0 * x / (SHAPE[1] - 1) - 1.0, 2.0 * y / (SHAPE[0] - 1) - 1.0
        return self.level + self.right * s + self.down * t + self.curve * (s * s - 0.5 * t * s)


STRAIGHT = Bend()
BENDS = (
    STRAIGHT,
    Bend(0.3, 0.2, 0.0, -0.3),
    Bend(-1.2, 0.5, 0.4, 0.3),
    Bend(0.0, 0.4, -0.4, 0.2),
    Bend(0.7, 0.0, 0.3, -0.5),
)


def is_on_row(view: int) -> bool:
    return PLACES[view, 1] == 0.0


def render(bends: tuple[Bend, ...], moved_steps: Array | None = None) -> Array:
    """Views whose pixel shows what a faultless one shows at a place beside it, (V, H, W)."""
    rows, columns = np.indices(SHAPE).astype(np.float64)
    places = PLACES if moved_steps is None else PLACES + moved_steps
    views = np.zeros((len(PLACES), *SHAPE))
    for view, bend in enumerate(bends):
        offset = bend(columns, rows)
        p, q = columns, rows
        if is_on_row(view):
            q = q - offset
        else:
            p = p - offset
        for surface in SURFACES:
            u, v = p, q
            for _ in range(30):
                slope = surface.slope_px(u, v)
                u, v = p + slope * places[view, 0], q + slope * places[view, 1]
            inside = surface.covers(u, v)
            views[view][inside] = surface.grey(u[inside], v[inside])
    return views


def views_of(exact: Array, noise: float = 1.0) -> RectifiedViews:
    return RectifiedViews(expose(exact, noise=noise, seed=6), PLACES[:, 0], PLACES[:, 1], 0)


def rows_of(views: RectifiedViews) -> RowErrors:
    return fit_together(views, window_of(views.shape, RANGE_PX, None), 1.0, None).mending.rows


@cache
def bent() -> RectifiedViews:
    return views_of(render(BENDS))


@cache
def faultless() -> RectifiedViews:
    return views_of(render((STRAIGHT,) * 5))


@cache
def rows_of_bent() -> RowErrors:
    return rows_of(bent())


@cache
def rows_of_one_bent() -> RowErrors:
    """Of view 2 alone."""
    pictures = faultless().images.copy()
    pictures[2] = bent().images[2]
    return rows_of(replace(faultless(), images=pictures))


@cache
def slopes_of_bent() -> SlopeMap:
    return estimate_slopes(bent(), RANGE_PX)


@cache
def slopes_of_faultless() -> SlopeMap:
    return estimate_slopes(faultless(), RANGE_PX)


def true_beside_px(view: int) -> Array:
    """How far what belongs at each pixel lies right of it (column) or below it (row), (H, W)."""
    rows, columns = np.indices(SHAPE).astype(np.float64)
    beside = np.zeros(SHAPE)
    for _ in range(30):
        x, y = (0.0, beside) if is_on_row(view) else (beside, 0.0)
        beside = BENDS[view](columns + x, rows + y)
    return beside


@pytest.mark.parametrize("view", [1, 2, 3, 4])
def test_fields_across_the_lines_are_recovered(view: int) -> None:
    found = rows_of_bent()
    field = found.fields[view]
    assert field is not None
    beside = field.everywhere() * found.across[view][1 if is_on_row(view) else 0]
    error = beside - true_beside_px(view)
    inner = (slice(24, -24), slice(24, -24))  # patches with their slopes fit in
    assert np.sqrt((error[inner] ** 2).mean()) < 0.06
    assert np.sqrt((true_beside_px(view) ** 2).mean()) == pytest.approx(found.rms_px[view], rel=0.5)


def test_the_reference_has_no_error() -> None:
    found = rows_of_bent()
    assert found.any
    assert found.fields[0] is None
    assert found.rms_px[0] == 0.0


def test_slopes_are_as_good_as_those_of_a_faultless_rig() -> None:
    truth = true_slope_px(SURFACES, SHAPE)
    inner = (slice(12, -12), slice(12, -12))
    bad, middle = [], []
    for found in (slopes_of_faultless(), slopes_of_bent()):
        error = np.abs(found.slope_px - truth)[inner]
        bad.append(np.mean(~(error < 0.5)))
        middle.append(np.nanmedian(error))
    assert bad[1] < bad[0] + 0.02
    assert middle[1] < 1.5 * middle[0] + 0.01


def test_bent_rows_are_named_with_where_they_are_worst() -> None:
    said = [text for text in slopes_of_bent().warnings if text.startswith("rows: ")]
    assert [text.split(" at ")[0] for text in said] == [f"rows: view {i}" for i in (1, 2, 3, 4)]
    assert "px high at the" in said[1]
    assert "px rms" in said[1]
    assert "calibrate the rig" in said[1]


def test_only_the_bent_view_is_named() -> None:
    found = rows_of_one_bent()
    assert [one is not None for one in found.fields] == [False, False, True, False, False]


def test_a_known_error_is_taken_as_it_is() -> None:
    known = slopes_of_bent().mending
    assert known is not None
    again = estimate_slopes(replace(bent(), mending=known), RANGE_PX)
    assert again.mending is not None
    assert again.mending.rows is known.rows
    assert np.nanmedian(np.abs(again.slope_px - slopes_of_bent().slope_px)) < 0.02


def test_nothing_is_named_of_a_faultless_rig() -> None:
    found = slopes_of_faultless()
    assert found.warnings == ()
    assert found.mending is not None
    assert not found.mending.rows.any


def test_a_camera_off_its_place_has_no_error_of_its_rows() -> None:
    """It moves what is nearer farther across its line: 0.1 steps are up to 0.5 px here."""
    moved = np.zeros_like(PLACES)
    moved[2] = 0.0, 0.1
    assert not rows_of(views_of(render((STRAIGHT,) * 5, moved))).any


def test_bars_that_repeat_tell_nothing_across_them() -> None:
    """Vertical bars say where columns lie, and of rows nothing, whatever the noise pretends."""
    columns = np.arange(SHAPE[1]) * 1.0
    bars = [
        np.tile(120.0 + 70.0 * np.sin(2.0 * np.pi * (columns + 1.5 * x) / 11.0), (SHAPE[0], 1))
        for x in PLACES[:, 0]
    ]
    assert not rows_of(views_of(np.stack(bars))).any


@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
def test_pictures_stay_as_they_are_where_nothing_is_wrong(kind: str) -> None:
    images = faultless().images.astype(kind)
    assert RowErrors.none(5).mended(images) is images


def test_only_what_is_wrong_is_mended() -> None:
    found = rows_of_one_bent()
    images = bent().images
    mended = found.mended(images)
    assert mended.dtype == np.float32
    assert np.array_equal(mended[[0, 1, 3, 4]], images[[0, 1, 3, 4]])
    right = faultless().images.astype(float)
    inner = (slice(12, -12), slice(12, -12))
    before = np.abs(images[2] - right[2])[inner].mean()
    assert np.abs(mended[2] - right[2])[inner].mean() < 0.2 * before


def test_errors_of_some_of_the_views_are_kept_in_order() -> None:
    found = rows_of_bent()
    some = found.kept(np.array([True, False, True, False, True]))
    assert some.fields == (found.fields[0], found.fields[2], found.fields[4])
    assert np.array_equal(some.across, found.across[[0, 2, 4]])
    assert np.array_equal(some.rms_px, found.rms_px[[0, 2, 4]])
    x, y = PLACES[[0, 2, 4]].T
    said = some.warnings(x, y)
    assert len(said) == 2
    assert said[0].startswith("rows: view 1 at (0.97, 0)")
    assert said[1].startswith("rows: view 2 at (0, 1.05)")


def test_views_whose_rows_meet_have_no_scatter_and_no_warnings() -> None:
    none = RowErrors.none(5)
    assert not none.any
    assert none.scatter_px == 0.0
    assert none.warnings(PLACES[:, 0], PLACES[:, 1]) == ()


@pytest.mark.parametrize(("shape", "channels"), [((4, 8, 9), 1), ((4, 8, 9, 3), 3)])
def test_no_light_is_told_of_every_channel_and_view(shape: tuple[int, ...], channels: int):
    light = fitting._no_light(np.zeros(shape, np.float32))
    assert [len(views) for views in light] == [4] * channels
    assert {field for views in light for field in views} == {None}


def test_what_rows_miss_by_does_not_depend_on_what_is_called_a_step():
    def found(step: float) -> RowErrors:
        known = replace(RowErrors.none(5), per_slope=step * np.array([0.0, 0.2, -0.1, 0.0, 0.1]))
        places = step * PLACES
        views = RectifiedViews(bent().images, places[:, 0], places[:, 1], 0, row_errors=known)
        range_px = RANGE_PX[0] / step, RANGE_PX[1] / step
        window = window_of(views.shape, range_px, None)
        return fit_together(views, window, 1.0, None).mending.rows

    one, two = found(1.0), found(2.0)
    assert two.rms_px == pytest.approx(one.rms_px, abs=0.03)
    x, y = np.array([40.0, 120.0, 200.0]), np.array([50.0, 100.0, 150.0])
    for first, second in zip(one.fields, two.fields, strict=True):
        assert (first is None) == (second is None)
        if first is not None and second is not None:
            assert second.at(x, y) == pytest.approx(first.at(x, y), abs=0.05)
