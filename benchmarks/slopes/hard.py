"""Scenes where a matcher is sure and wrong: plain walls, repetition, wires, gaps, glass, range."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.slopes import hard_scenes as hs
from benchmarks.slopes import thin
from benchmarks.slopes.asked import Asked
from benchmarks.slopes.hard_scenes import CROSS, ROW, UNEVEN, Still, make_still
from benchmarks.slopes.honesty import HONESTY_HEAD, LEGEND, honesty_columns, measure_honesty, told
from benchmarks.slopes.poles import CROSS_OF_POLES, ROW_OF_POLES, poles
from benchmarks.slopes.scenes import Layout, Scene
from benchmarks.slopes.texture import textured
from rig.epipolar import SlopeMap, estimate_slopes

Found = Callable[[SlopeMap, Scene], str]
_SEEDS = (("C", 60), ("R", 75))
_ROW_AND_CROSS = (("row", ROW), ("cross", CROSS))
_AROUND_SQUARE_PX = 40
_WIRES_PX = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 20.0)
_INNER = (
    slice(hs.PANE_PX[1] + 20, hs.PANE_PX[3] - 20),
    slice(hs.PANE_PX[0] + 20, hs.PANE_PX[2] - 20),
)
"""Rows and columns of the pane and the mirror, less where their border hides something."""
_GREY_WIRES_PX = 1.5, 2.0, 3.0
_SLANTS = (0.0, 0.02, 0.04, 0.06, 0.1)


@dataclass(frozen=True)
class Hard:
    """One line: a scene, its noise, and what is to be said of it besides honesty."""

    layout: str
    still: Still
    noise_levels: float = 1.0
    say: Found = lambda found, scene: ""


def hard(asked: Asked) -> None:
    """Print honesty of every scene and what it is about; truth is exact."""
    print(LEGEND)
    print(f"{'':1} {'scene':42} {HONESTY_HEAD} {'s':>5}")
    for half, seed in _SEEDS:
        for case in _cases(seed):
            name = f"{case.still.name}, {case.layout}, noise {case.noise_levels:g}"
            if asked.wants(name):
                _line(f"{half} {name}", case, make_still(case.still, case.noise_levels, half))


def _line(name: str, case: Hard, scene: Scene) -> None:
    start = time.perf_counter()
    found = estimate_slopes(scene.views, scene.range_px)
    took_s = time.perf_counter() - start
    true_px = scene.slope_px
    if case.still.reflected or case.still.by_column:  # no slope explains what is seen there
        true_px = true_px.copy()
        true_px[_INNER] = np.nan
    h = measure_honesty(found, true_px, scene.range_px, 0, textured(scene))
    said = case.say(found, scene)
    print(
        f"{name:44} {honesty_columns(h)} {took_s:5.2f}  {said}"
        f"{' | ' if said and found.warnings else ''}{told(found.warnings)}",
        flush=True,
    )


def _cases(seed: int) -> Iterator[Hard]:
    for name, layout in _ROW_AND_CROSS:
        for noise in (1.0, 3.0):
            yield Hard(name, hs.plain_wall(layout, seed, shaded=False), noise, _wall)
            yield Hard(name, hs.plain_wall(layout, seed, shaded=True), noise, _wall)
        yield Hard(name, hs.stripes(layout, seed))
    for period_px in (4.0, 7.0):
        for name, layout in (("whole steps", ROW), ("uneven steps", UNEVEN)):
            yield Hard("row", hs.sine(layout, seed, period_px, name))
    yield from _thin(seed)
    for name, layout in _ROW_AND_CROSS:
        yield from _layered(name, layout, seed)
    yield Hard("cross", hs.mirror(CROSS, seed, curved=True), 1.0, _between(hs.MIRROR_SLOPES_PX))
    yield Hard("9 + 9", hs.too_far(seed), 1.0, _outside)
    for slant in _SLANTS:
        yield Hard("row of 9", hs.slanted(seed, slant))


def _thin(seed: int) -> Iterator[Hard]:
    for name, layout in _ROW_AND_CROSS:
        for width_px in _WIRES_PX:
            yield Hard(name, hs.wires(layout, seed, width_px), 1.0, thin.wires)
        for width_px in _GREY_WIRES_PX:
            grey = hs.wires(layout, seed, width_px, hs.GREY_LEVELS)
            yield Hard(name, grey, 1.0, thin.wires)
    for name, layout in (("row", ROW_OF_POLES), ("cross", CROSS_OF_POLES)):
        for width_px, contrast in ((4.0, 20.0), (4.0, 5.0), (10.0, 5.0)):
            yield Hard(name, poles(layout, seed, width_px, contrast), 1.0, thin.wires)


def _layered(name: str, layout: Layout, seed: int) -> Iterator[Hard]:
    yield Hard(name, hs.mesh(layout, seed), 1.0, thin.gaps)
    yield Hard(name, hs.leaves(layout, seed), 1.0, thin.gaps)
    yield Hard(name, hs.pane(layout, seed), 1.0, _either)
    yield Hard(name, hs.mirror(layout, seed, curved=False))


def _wall(found: SlopeMap, scene: Scene) -> str:
    """Of the wall, away from the square."""
    left, top, right, bottom = hs.SQUARE_PX
    rows, columns = np.indices(scene.slope_px.shape)
    near = (columns > left - _AROUND_SQUARE_PX) & (columns < right + _AROUND_SQUARE_PX)
    near &= (rows > top - _AROUND_SQUARE_PX) & (rows < bottom + _AROUND_SQUARE_PX)
    h = measure_honesty(found, np.where(near, np.nan, scene.slope_px), scene.range_px)
    return f"wall: blind {h.blind:.1f}, answered {h.answered:.1f}, confidently wrong {h.wrong:.1f}"


def _outside(found: SlopeMap, scene: Scene) -> str:
    """Of the pixels whose slope lies beyond the range."""
    low, high = scene.range_px
    outside = (scene.slope_px < low) | (scene.slope_px > high)
    h = measure_honesty(found, np.where(outside, scene.slope_px, np.nan), scene.range_px)
    edge_px = 0.05 * (high - low)
    with np.errstate(invalid="ignore"):
        at_edge = (found.slope_px < low + edge_px) | (found.slope_px > high - edge_px)
    return (
        f"outside {100 * outside.mean():.1f}: blind {h.blind:.1f}, at the edge "
        f"{100 * at_edge[outside].mean():.1f}, confidently wrong {h.wrong:.1f}"
    )


def _either(found: SlopeMap, scene: Scene) -> str:
    """Of the pane: the wall, the reflection, or neither."""
    del scene
    part = _inside(found)
    error_px = np.min([np.abs(part.slope_px - m) for m in hs.PANE_SLOPES_PX], axis=0)
    return _contradicted("pane", part, error_px)


def _between(slopes_px: tuple[float, float]) -> Found:
    def say(found: SlopeMap, scene: Scene) -> str:
        del scene
        part = _inside(found)
        low, high = slopes_px
        error_px = np.maximum(low - part.slope_px, part.slope_px - high)
        return _contradicted("mirror", part, np.maximum(error_px, np.float32(0.0)))

    return say


def _inside(found: SlopeMap) -> SlopeMap:
    """The part of a map where the pane is."""
    return SlopeMap(found.slope_px[_INNER], found.sigma_px[_INNER], found.label[_INNER])


def _contradicted(what: str, part: SlopeMap, error_px: hs.Array) -> str:
    """Who answers here should be unsure: no slope explains all views."""
    with np.errstate(invalid="ignore"):
        sure = part.sigma_px < 0.2
        wrong = (error_px > 0.5) & (error_px > 5.0 * part.sigma_px)
    return (
        f"{what}: blind {100 * (part.label == 0).mean():.1f}, sigma < 0.2 px "
        f"{100 * sure.mean():.1f}, confidently none of the two {100 * wrong.mean():.1f}"
    )
