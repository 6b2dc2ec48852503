"""Print accuracy, honesty and time of `estimate_slopes` beside OpenCV's matchers.

Run `python -m benchmarks.slopes` (all), or name parts: `dino`, `chosen`, `reported`, `layouts`,
`live`.
"""

import sys
import time
from collections.abc import Callable, Iterable
from functools import partial
from statistics import median
from typing import TypeVar

import numpy as np

from benchmarks.slopes.dino import dino_folder, load_dino
from benchmarks.slopes.scenes import (
    CHOSEN_ON,
    LAYOUTS,
    REPORTED_ON,
    SPARSE,
    Recipe,
    Scene,
    make_scene,
)
from benchmarks.slopes.scores import Scores, score
from rig.compare.baselines import FILLED
from rig.epipolar import SlopePrior, estimate_slopes

Result = TypeVar("Result")
_REPEATS = 3
_HEAD = (
    f"{'scene':28} {'method':16} {'BP.01':>6} {'BP.03':>6} {'BP.07':>6} {'bad 1':>6} "
    f"{'MSEx100':>8} {'edge':>6} {'dens':>6} {'BP.07 of':>8} {'err/':>6} {'wall':>6} {'cpu':>6}\n"
    f"{'':102}{'best 80%':>9} {'sigma':>6} {'ms':>6} {'ms':>6}"
)


def timed(work: Callable[[], Result]) -> tuple[Result, tuple[float, float]]:
    """Result, and median wall and processor time in ms after one call to warm up."""
    result = work()
    wall: list[float] = []
    processor: list[float] = []
    for _ in range(_REPEATS):
        start, start_processor = time.perf_counter(), time.process_time()
        work()
        wall.append(1e3 * (time.perf_counter() - start))
        processor.append(1e3 * (time.process_time() - start_processor))
    return result, (median(wall), median(processor))


def line(scene: str, method: str, s: Scores, ms: tuple[float, float]) -> None:
    print(
        f"{scene:28} {method:16} {s.bad_001:6.2f} {s.bad_003:6.2f} {s.bad_007:6.2f} {s.bad_1:6.2f} "
        f"{s.mse_100:8.3f} {s.edge_bad:6.2f} {s.density:6.1f} {s.confident_bad_007:8.2f} "
        f"{s.sigma_ratio:6.2f} {ms[0]:6.0f} {ms[1]:6.0f}",
        flush=True,
    )


def compare(scenes: Iterable[Scene]) -> None:
    print(_HEAD)
    for scene in scenes:
        slopes, ms = timed(partial(estimate_slopes, scene.views, scene.range_px))
        truth = (scene.slope_px, scene.range_px, scene.border_px)
        line(scene.name, "rig", score(slopes.slope_px, slopes.sigma_px, *truth), ms)
        for method in FILLED:
            slope, ms = timed(partial(method.run, scene.views, scene.range_px))
            line("", method.name, score(slope, None, *truth), ms)


def live() -> None:
    """Four frames of a still scene, each with the previous one as hypothesis; then a jump."""
    print(_HEAD)
    still, jumped = make_scene(Recipe("still", 40, SPARSE)), make_scene(Recipe("jump", 41, SPARSE))
    prior = None
    for frame, scene in enumerate([still] * 4 + [jumped] * 3):
        slopes, ms = timed(partial(estimate_slopes, scene.views, scene.range_px, prior))
        found = score(slopes.slope_px, slopes.sigma_px, scene.slope_px, scene.range_px, 0)
        line(f"frame {frame}, {scene.name}", "rig", found, ms)
        prior = SlopePrior(slopes.slope_px, slopes.sigma_px)


def main(parts: list[str]) -> None:
    wanted = parts or ["dino", "chosen", "reported", "layouts", "live"]
    if "dino" in wanted:
        folder = dino_folder()
        print("\n# hci-dino, 9 + 9 views of 512 x 512, against another method's map")
        if folder is None:
            print("left out: set RIG_SHARED_DATA to the folder that holds hci-dino")
        else:
            compare(load_dino(folder, noise) for noise in (0.0, 1.0, 3.0))
    for part, title, recipes in (
        ("chosen", "Rendered scenes that the defaults were chosen on", CHOSEN_ON),
        ("reported", "Rendered scenes that nothing was chosen on", REPORTED_ON),
        ("layouts", "One scene, other arrangements of views", LAYOUTS),
    ):
        if part in wanted:
            print(f"\n# {title}")
            compare(make_scene(recipe) for recipe in recipes)
    if "live" in wanted:
        print("\n# Live: the previous frame as hypothesis, 5 views of 640 x 400")
        live()


if __name__ == "__main__":
    np.seterr(invalid="ignore")
    main(sys.argv[1:])
