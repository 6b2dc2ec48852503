"""Five-view rigs as they are built: rows that miss in a smooth field, light that differs."""

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes import fields
from benchmarks.slopes.asked import Asked
from benchmarks.slopes.fields import SmoothField, across_px, render_through
from benchmarks.slopes.honesty import HONESTY_HEAD, LEGEND, honesty_columns, measure_honesty, told
from benchmarks.slopes.scenes import SPARSE, Layout, Recipe, Scene, exact_views, surfaces_of
from benchmarks.slopes.stored import stored
from benchmarks.slopes.texture import textured
from rig.epipolar import RectifiedViews, estimate_slopes
from tests.support.lightfield import expose, true_slope_px

CROSS_OF_5 = SPARSE
ROW_OF_5 = Layout(np.array([0, -1.04, 0.97, -2.03, 1.98]), np.zeros(5), SPARSE.shape, (-10.0, 30.0))
_LIGHT_LEVELS, _MIDDLE_LEVELS = 15.0, 128.0


@dataclass(frozen=True)
class Fault:
    """What is wrong with a rig."""

    name: str
    rows_px: float = 0.0
    """Rms of the offsets across the epipolar lines."""
    gain_levels: float = 0.0
    """Peak of a smooth field of gains, as what it does to a middle grey."""
    light_levels: float = 0.0
    """Peak of a smooth field of stray light."""


FAULTS = (
    Fault("faultless"),
    Fault("rows 0.3 px", rows_px=0.3),
    Fault("rows 1 px", rows_px=1.0),
    Fault("rows 2 px", rows_px=2.0),
    Fault("gains 15 levels", gain_levels=_LIGHT_LEVELS),
    Fault("stray light 15 levels", light_levels=_LIGHT_LEVELS),
    Fault("rows 1 px, gains 15", rows_px=1.0, gain_levels=_LIGHT_LEVELS),
)
_RIGS = (
    ("C", Recipe("cross of 5", 50, CROSS_OF_5)),
    ("C", Recipe("row of 5", 51, ROW_OF_5)),
    ("R", Recipe("cross of 5", 52, CROSS_OF_5)),
    ("R", Recipe("row of 5", 53, ROW_OF_5)),
    ("R", Recipe("row of 5, weak", 54, ROW_OF_5, contrast=6.0, finest_px=2.5)),
)


def rigs(asked: Asked) -> None:
    """Print every rig with every fault, and its bad pixels over those of the faultless one."""
    print(LEGEND)
    print(f"{'':1} {'rig':40} {HONESTY_HEAD} {'ratio':>6} {'s':>5}  warnings")
    for half, recipe in _RIGS:
        faultless = np.nan
        for fault in FAULTS:
            name = f"{recipe.name} {recipe.seed}: {fault.name}"
            if not (asked.wants(name) or (fault.name == "faultless" and _asked(asked, recipe))):
                continue
            has_texture = textured(faulty_scene(recipe, FAULTS[0]))
            bad = _line(name, faulty_scene(recipe, fault, half), has_texture, faultless)
            faultless = bad if fault.name == "faultless" else faultless


def _asked(asked: Asked, recipe: Recipe) -> bool:
    return any(asked.wants(f"{recipe.name} {recipe.seed}: {fault.name}") for fault in FAULTS)


def _line(name: str, scene: Scene, has_texture: NDArray[np.bool_], faultless: float) -> float:
    start = time.perf_counter()
    found = estimate_slopes(scene.views, scene.range_px)
    took_s = time.perf_counter() - start
    h = measure_honesty(found, scene.slope_px, scene.range_px, 0, has_texture)
    print(
        f"{scene.half:1} {name:40} {honesty_columns(h)} {h.bad / faultless:6.2f} {took_s:5.2f}  "
        f"{told(found.warnings)}",
        flush=True,
    )
    return h.bad


def row_offsets_px(recipe: Recipe, fault: Fault) -> NDArray[np.float64]:
    """(V, H, W) by how much each picture lies below (on the column: right of) its lines, px."""
    return np.stack(
        [
            np.zeros(recipe.layout.shape) if field is None else field.over_picture()
            for field in across_px(recipe.layout, fault.rows_px, recipe.seed)
        ]
    )


def faulty_scene(recipe: Recipe, fault: Fault, half: str = "-") -> Scene:
    """Render a recipe through a fault; gains of whole views differ as the recipe says."""
    layout = recipe.layout
    surfaces = list(surfaces_of(recipe))
    if fault.rows_px > 0.0:
        told_of = f"rows {recipe} {fault.rows_px}"
        offsets_px = across_px(layout, fault.rows_px, recipe.seed)
        source = sys.modules[fields.__name__], surfaces_of
        clean = stored(lambda: render_through(surfaces, layout, offsets_px), told_of, *source)
    else:
        clean = exact_views(recipe)
    lit = clean.astype(np.float64)
    for view, (gain, stray) in enumerate(_light(recipe, fault)):
        lit[view] = lit[view] * (1.0 + gain / _MIDDLE_LEVELS) + stray
    frames = expose(lit, noise=recipe.noise, gain_spread=recipe.gain_spread, seed=recipe.seed)
    return Scene(
        f"{recipe.name}, {fault.name}",
        RectifiedViews(frames, layout.x_steps, layout.y_steps, 0),
        true_slope_px(surfaces, layout.shape),
        layout.range_px,
        border_px=0,
        noise_levels=recipe.noise,
        clean=clean,
        half=half,
    )


def _light(
    recipe: Recipe, fault: Fault
) -> Iterator[tuple[NDArray[np.float64] | float, NDArray[np.float64] | float]]:
    """Fields of gain and of stray light of each view, grey levels; the reference has none."""
    for view in range(len(recipe.layout.x_steps)):
        if view == 0:
            yield 0.0, 0.0
            continue
        drawn = [
            SmoothField(7000 + 100 * recipe.seed + 10 * k + view, recipe.layout.shape)
            for k in range(2)
        ]
        yield (
            drawn[0].with_peak(fault.gain_levels).over_picture(),
            drawn[1].with_peak(fault.light_levels).over_picture(),
        )
