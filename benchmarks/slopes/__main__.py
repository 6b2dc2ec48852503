"""Print accuracy, honesty and time of `estimate_slopes` beside OpenCV's matchers.

Run `python -m benchmarks.slopes` (all), or name parts: `dino`, `chosen`, `reported`, `layouts`,
`live`, `planes`, `shade`, `places`, `colour`, `first`, and those of `NARROWED`, where
`NAME:WORD` runs only the lines whose name contains the word. `--pictures DIR` writes pictures.
"""

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.slopes.alike import alike
from benchmarks.slopes.asked import Asked
from benchmarks.slopes.colour import colour
from benchmarks.slopes.degraded import degraded_frames
from benchmarks.slopes.dino import dino_folder, load_dino
from benchmarks.slopes.first_use import first_use
from benchmarks.slopes.hard import hard
from benchmarks.slopes.honesty import honest
from benchmarks.slopes.pairs import pairs
from benchmarks.slopes.places import places
from benchmarks.slopes.plane import measure_plane
from benchmarks.slopes.real import real
from benchmarks.slopes.rigs import rigs
from benchmarks.slopes.ripple import Estimate, measure_ripple
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
from benchmarks.slopes.shade import shade
from benchmarks.slopes.timing import Times, race
from rig.compare.baselines import FILLED
from rig.epipolar import SlopePrior, estimate_slopes

_ROUNDS = 3
_HEAD = (
    f"{'scene':28} {'method':16} {'BP.01':>6} {'BP.03':>6} {'BP.07':>6} {'bad 1':>6} "
    f"{'MSEx100':>8} {'edge':>6} {'dens':>6} {'BP.07 of':>8} {'err/':>6} {'wall':>6} {'cpu':>6} "
    f"{'wall':>6} {'cpu':>6} {'wall':>6} {'cpu':>6}\n"
    f"{'':102}{'best 80%':>9} {'sigma':>6} {'ms':>6} {'ms':>6} "
    f"{'/ SGBM-3WAY':>13} {'/ SGBM-HH':>13}"
)


def line(scene: str, method: str, s: Scores, took: Times, times: Mapping[str, Times]) -> None:
    ratios = " ".join(
        f"{took.wall_ms / other.wall_ms:6.2f} {took.cpu_ms / other.cpu_ms:6.2f}"
        for other in (times[method.name] for method in FILLED)
    )
    print(
        f"{scene:28} {method:16} {s.bad_001:6.2f} {s.bad_003:6.2f} {s.bad_007:6.2f} {s.bad_1:6.2f} "
        f"{s.mse_100:8.3f} {s.edge_bad:6.2f} {s.density:6.1f} {s.confident_bad_007:8.2f} "
        f"{s.sigma_ratio:6.2f} {took.wall_ms:6.0f} {took.cpu_ms:6.0f} {ratios}",
        flush=True,
    )


def compare(scenes: Iterable[Scene]) -> None:
    print(_HEAD)
    for scene in scenes:
        given = scene.views, scene.range_px
        ways = {m.name: partial(m.run, *given) for m in FILLED}
        times = race({"rig": partial(estimate_slopes, *given), **ways}, _ROUNDS)
        truth = (scene.slope_px, scene.range_px, scene.border_px)
        slopes = estimate_slopes(*given)
        ours = score(slopes.slope_px, slopes.sigma_px, *truth)
        line(scene.name, "rig", ours, times["rig"], times)
        for name, run in ways.items():
            line("", name, score(run(), None, *truth), times[name], times)


def live() -> None:
    """Frames of a still scene, each with the previous one as hypothesis; then a jump."""
    print(_HEAD)
    still, jumped = make_scene(Recipe("still", 40, SPARSE)), make_scene(Recipe("jump", 41, SPARSE))
    prior = None
    for frame, scene in enumerate([still] * 5 + [jumped] * 3):
        given = scene.views, scene.range_px
        ways = {m.name: partial(m.run, *given) for m in FILLED}
        times = race({"rig": partial(estimate_slopes, *given, prior), **ways}, _ROUNDS)
        slopes = estimate_slopes(*given, prior)
        found = score(slopes.slope_px, slopes.sigma_px, scene.slope_px, scene.range_px, 0)
        line(f"frame {frame}, {scene.name}", "rig", found, times["rig"], times)
        if frame in (0, 4):
            for name in ways:
                took = times[name]
                print(f"{'':28} {name:16} wall {took.wall_ms:.0f} cpu {took.cpu_ms:.0f} ms")
        sigma_px = np.maximum(slopes.sigma_px, np.float32(0.2))
        prior = SlopePrior(slopes.slope_px, sigma_px, slopes.steady)


def planes() -> None:
    for name, is_tilted in (("square-on", False), ("tilted 5.7 degrees", True)):
        e = measure_plane(is_tilted=is_tilted)
        print(
            f"{name:28} sub-pixel rms {e.subpixel_rms_px:.4f}  bias {e.bias_px:+.4f}  "
            f"ripple {e.ripple_px:.4f} px"
        )
    ways: dict[str, Estimate] = {"rig": lambda *given: estimate_slopes(*given).slope_px}
    ways |= {m.name: m.run for m in FILLED}
    for name, estimate in ways.items():
        for noise in (0.0, 2.0):
            r = measure_ripple(estimate, noise)
            print(
                f"waves, noise {noise:g}, {name:16} bias {r.bias_px:+.4f}  "
                f"ripple {r.largest_px:.4f} px, {r.doubt_px:.4f} of it by chance"
            )


def dino() -> None:
    folder = dino_folder()
    if folder is None:
        print("left out: set RIG_SHARED_DATA to the folder that holds hci-dino")
    else:
        compare(load_dino(folder, noise) for noise in (0.0, 1.0, 3.0))


def rendered(recipes: Iterable[Recipe]) -> None:
    compare(make_scene(recipe) for recipe in recipes)


PARTS: dict[str, tuple[str, Callable[[], None]]] = {
    "dino": ("hci-dino, 9 + 9 views of 512 x 512, against another method's map", dino),
    "chosen": (
        "Rendered scenes that the defaults were chosen on", partial(rendered, CHOSEN_ON)
    ),
    "reported": (
        "Rendered scenes that nothing was chosen on", partial(rendered, REPORTED_ON)
    ),
    "layouts": ("One scene, other arrangements of views", partial(rendered, LAYOUTS)),
    "live": ("Live: the previous frame as hypothesis, 5 views of 640 x 400", live),
    "planes": (
        "A plane that moves through one px of slope, sparse cross of five, noise 2", planes
    ),
    "shade": ("Half of the scene in the shadow, noise that grows with light", shade),
    "places": ("Views that are not where they are told to be", places),
    "colour": ("Colour against luminance", colour),
    "first": ("First use", first_use),
}  # fmt: skip


NARROWED: dict[str, tuple[str, Callable[[Asked], None]]] = {
    "honest": ("What is blind, answered, wrong, and how sure it was", honest),
    "degraded": ("What cameras and their files do to pictures", degraded_frames),
    "alike": ("Noise that files and denoisers make alike", alike),
    "real": ("Real pairs, against SGBM-HH on frames with rows and light mended", real),
    "pairs": ("Pairs with true disparities, at the density of SGBM-HH with its check", pairs),
    "rigs": ("Five-view rigs whose rows miss and whose light differs", rigs),
    "hard": ("Plain walls, repetition, wires, gaps, glass, slants, a range too small", hard),
}  # fmt: skip
"""Parts of many lines, which can be narrowed to some of them."""


def main(wanted: list[str], pictures: Path | None = None) -> None:
    names = [name.partition(":")[::2] for name in wanted or [*PARTS, *NARROWED]]
    if unknown := {name for name, _ in names} - set(PARTS) - set(NARROWED):
        found = ", ".join([*PARTS, *NARROWED])
        sys.exit(f"no part {', '.join(sorted(unknown))}; there are: {found}")
    for name, word in names:
        if name in PARTS:
            title, run = PARTS[name]
            print(f"\n# {title}", flush=True)
            run()
        else:
            title, narrowed = NARROWED[name]
            print(f"\n# {title}", flush=True)
            narrowed(Asked(word, pictures))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.slopes", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="NAME", help="parts to run; all by default")
    parser.add_argument("--pictures", type=Path, help="folder for pictures to look at")
    arguments = parser.parse_args()
    np.seterr(invalid="ignore")
    main(arguments.parts, arguments.pictures)
