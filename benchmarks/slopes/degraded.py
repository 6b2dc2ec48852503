"""Frames made worse by what cameras and files do, beside SGBM-HH on the same frames."""

import time
from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.slopes.antinous import Arms, load_antinous
from benchmarks.slopes.asked import Asked
from benchmarks.slopes.degrade import (
    Degradation,
    copied,
    dark,
    defocus,
    degraded,
    gamma,
    hot_pixels,
    jpeg,
    median,
    row_banding,
    vignette,
    without_view,
)
from benchmarks.slopes.dino import dino_folder, load_dino
from benchmarks.slopes.honesty import HONESTY_HEAD, LEGEND, honesty_columns, measure_honesty, told
from benchmarks.slopes.scenes import DENSE, SPARSE, Recipe, Scene, make_scene
from benchmarks.slopes.scores import score
from benchmarks.slopes.texture import textured
from rig.compare.baselines import FILLED
from rig.epipolar import estimate_slopes

_FULL = next(method for method in FILLED if method.name == "SGBM-HH filled")
_PLACE_ERROR_STEPS, _PLACE_ERROR_PX = 0.1, 0.2
"""In dense light fields; in sparse arrays what shifts the picture as much at the largest slope."""


def degraded_frames(asked: Asked) -> None:
    """Print honesty of ours and the share of bad pixels of SGBM-HH for each degradation.

    A line is named `scene: degradation`; a word narrows to either.
    """
    print(LEGEND)
    print(f"{'':1} {'scene: degradation':48} {HONESTY_HEAD} {'HH bad':>6} {'s':>5}  warnings")
    for name, load in _scenes():
        scene: Scene | None = None
        for how in _degradations():
            line_name = f"{name}: {how.name}"
            if not asked.wants(line_name):
                continue
            scene = scene or load()
            if scene is None:
                print(f"{name} left out: it is not in the folder RIG_SHARED_DATA")
                break
            _line(line_name, degraded(scene, _fitted(how, scene)))


def _line(name: str, scene: Scene) -> None:
    start = time.perf_counter()
    found = estimate_slopes(scene.views, scene.range_px)
    took_s = time.perf_counter() - start
    truth = scene.slope_px, scene.range_px, scene.border_px
    h = measure_honesty(found, *truth, textured(scene))
    s = score(_FULL.run(scene.views, scene.range_px), None, *truth)
    theirs = s.bad_007 if scene.is_dense else s.bad_1
    print(
        f"{scene.half:1} {name:48} {honesty_columns(h)} {theirs:6.2f} {took_s:5.2f}  "
        f"{told(found.warnings)}",
        flush=True,
    )


def _scenes() -> Iterator[tuple[str, Callable[[], Scene | None]]]:
    def dino() -> Scene | None:
        folder = dino_folder()
        return None if folder is None else load_dino(folder, 0.0)

    def antinous(arms: Arms) -> Callable[[], Scene | None]:
        return lambda: load_antinous(arms)

    def own(recipe: Recipe) -> Callable[[], Scene | None]:
        return lambda: make_scene(recipe)

    yield "dino", dino
    yield "antinous cross", antinous("cross")
    yield "antinous row", antinous("row")
    yield "antinous column", antinous("column")
    for half, dense, sparse in (("chosen", 0, 4), ("reported", 10, 15)):
        yield f"dense rich {dense}, {half}", own(Recipe("dense rich", dense, DENSE))
        yield f"sparse rich {sparse}, {half}", own(Recipe("sparse rich", sparse, SPARSE))


def _fitted(how: Degradation, scene: Scene) -> Degradation:
    """The faults that depend on which scene it is."""
    if how.name == "a copy of the reference":
        return Degradation(how.name, camera=copied(scene.views.reference))
    if how.place_error_steps and not scene.is_dense:
        largest_px = float(np.nanmax(np.abs(scene.slope_px)))
        return Degradation(how.name, place_error_steps=_PLACE_ERROR_PX / largest_px)
    return how


def _degradations() -> tuple[Degradation, ...]:
    return (
        Degradation("as it is"),
        *(Degradation(f"noise {n:g}", noise_levels=n) for n in (1.0, 3.0, 8.0)),
        *(Degradation(f"JPEG {quality}", camera=jpeg(quality)) for quality in (95, 90, 70, 40)),
        Degradation("noise 3, median 3 x 3", noise_levels=3.0, camera=median),
        *(Degradation(f"row banding {n:g}", camera=row_banding(n)) for n in (0.5, 2.0)),
        Degradation("defocused 1.5 px", lens=defocus(1.5)),
        Degradation("hot pixels 0.2 %", camera=hot_pixels(0.002)),
        Degradation("dark, 20 levels", light=dark(20.0)),
        Degradation("vignettes 28-32 %, 15 px", light=vignette(0.28, 0.32, 15.0)),
        Degradation("vignettes 25-35 %, 25 px", light=vignette(0.25, 0.35, 25.0)),
        Degradation("vignettes 20-40 %, 40 px", light=vignette(0.20, 0.40, 40.0)),
        Degradation("vignette alike 30 %", light=vignette(0.3, 0.3, 0.0, alike=True)),
        Degradation("gamma 0.9-1.1", light=gamma(0.9, 1.1)),
        Degradation("positions off", place_error_steps=_PLACE_ERROR_STEPS),
        Degradation("a copy of the reference"),
        *(
            Degradation(f"one view {kind}", camera=without_view(kind))
            for kind in ("black", "white", "swapped")
        ),
    )
