"""Pairs with true disparities, at the density of SGBM-HH with its left-right check."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.asked import Asked
from benchmarks.slopes.dino import read_view, shared_folder
from benchmarks.slopes.honesty import measure_honesty, told
from benchmarks.slopes.scenes import PAIR, Recipe, Scene, make_scene
from rig.compare.baselines import BASELINES
from rig.epipolar import Label, RectifiedViews, SlopeMap, estimate_slopes

_BAD_PX = 1.0
_WIDER = 1.1
"""The range searched, over the largest true disparity."""
_CHECKED = next(method for method in BASELINES if method.name == "SGBM-HH")
_DEBIAN = Path("/usr/share/doc/opencv-doc/examples/data")
_RENDERED = (("C", 32), ("C", 33), ("R", 30), ("R", 34), ("R", 35))


@dataclass(frozen=True)
class TruePair:
    """A scene of two views, and how finely its truth is told."""

    scene: Scene
    truth_step_px: float = 0.0


def pairs(asked: Asked) -> None:
    """Print the bad pixels of both at one density, and what sigma is worth.

    Ours are ranked by sigma: the most confident ones, as many as SGBM-HH answers. Errors are over
    sigma and the rounding of the truth together.
    """
    print(
        f"{'':1} {'pair':22} {'HH dens':>7} {'HH bad':>7} {'ours':>7} {'ratio':>6} {'blind':>6} "
        f"{'answd':>6} {'bad':>6} {'conf.':>6} {'z':>5} {'z in fifths':>29} {'>3 s':>5} {'s':>6}"
        "  warnings"
    )
    for name, load in _pairs():
        if asked.wants(name):
            pair = load()
            if isinstance(pair, str):
                print(f"  {name:22} left out: {pair}")
            else:
                _line(name, pair)


def _line(name: str, pair: TruePair) -> None:
    scene = pair.scene
    start = time.perf_counter()
    found = estimate_slopes(scene.views, scene.range_px)
    took_s = time.perf_counter() - start
    theirs = _CHECKED.run(scene.views, scene.range_px)
    density, bad, ours = at_their_density(found, theirs, scene.slope_px)
    blurred = SlopeMap(
        found.slope_px,
        np.hypot(found.sigma_px, np.float32(pair.truth_step_px / np.sqrt(12.0))),
        found.label,
    )
    h = measure_honesty(blurred, scene.slope_px, scene.range_px)
    fifths = " ".join(f"{ratio:5.2f}" for ratio in h.fifths)
    print(
        f"{scene.half:1} {name:22} {density:7.1f} {bad:7.2f} {ours:7.2f} "
        f"{ours / max(bad, 1e-9):6.2f} {h.blind:6.1f} {h.answered:6.1f} {h.bad_answered:6.2f} "
        f"{h.wrong:6.2f} {h.sigma_ratio:5.2f} {fifths} {h.beyond_3:5.1f} {took_s:6.2f}  "
        f"{told(found.warnings)}",
        flush=True,
    )


def at_their_density(
    found: SlopeMap, theirs: NDArray[np.floating], true_px: NDArray[np.floating]
) -> tuple[float, float, float]:
    """Their density, their bad pixels among it, and ours among as many: per cent.

    Args:
        found: ours; who has no answer comes last and is bad.
        theirs: (H, W) px, NaN for no answer.
        true_px: (H, W), NaN where it is unknown, which counts nowhere.
    """
    known = np.isfinite(true_px)
    error = np.abs(theirs - true_px)[known]
    answered = np.isfinite(error)
    ours = np.abs(found.slope_px - true_px)[known]
    sighted = (found.label[known] != Label.NONE) & np.isfinite(ours)
    ours = np.where(sighted, ours, np.inf)
    sigma = np.where(sighted, found.sigma_px[known], np.inf)
    # Where sigma is one for all, nothing but the order of the pixels would decide: draw lots.
    lots = np.random.default_rng(0).random(sigma.size)
    first = np.lexsort((lots, sigma))[: int(answered.sum())]
    return (
        100.0 * float(answered.mean()),
        100.0 * float((error[answered] > _BAD_PX).mean()),
        100.0 * float((ours[first] > _BAD_PX).mean()),
    )


def _pairs() -> Iterator[tuple[str, Callable[[], TruePair | str]]]:
    def middlebury(name: str) -> Callable[[], TruePair | str]:
        return lambda: _middlebury(name)

    def rendered(half: str, seed: int) -> Callable[[], TruePair]:
        def load() -> TruePair:
            scene = make_scene(Recipe("pair", seed, PAIR))
            parts = (scene.views, scene.slope_px, scene.range_px, 0)
            return TruePair(Scene(scene.name, *parts, noise_levels=2.0, half=half))

        return load

    yield "cones", middlebury("cones")
    yield "teddy", middlebury("teddy")
    yield "aloe, half size", lambda: _aloe(2)
    yield "aloe", lambda: _aloe(1)
    for half, seed in _RENDERED:
        yield f"rendered {seed}", rendered(half, seed)


def _middlebury(name: str) -> TruePair | str:
    folder = shared_folder("middlebury")
    if folder is None:
        return "set RIG_SHARED_DATA to the folder that holds middlebury"
    left, right, truth = (read_view(folder / name / f) for f in ("im2.png", "im6.png", "disp2.pgm"))
    return _true_pair(name, left, right, truth / 4.0, 0.25)


def _aloe(smaller: int) -> TruePair | str:
    names = [_DEBIAN / f"aloe{part}" for part in ("L.jpg", "R.jpg", "GT.png")]
    if not all(name.is_file() for name in names):
        return f"install Debian's package opencv-doc, which has {names[0]}"
    left, right, truth = (read_view(name) for name in names)
    if smaller > 1:
        size = left.shape[1] // smaller, left.shape[0] // smaller
        left, right = _shrunk(left, size), _shrunk(right, size)
        truth = truth[: size[1] * smaller : smaller, : size[0] * smaller : smaller] / smaller
    return _true_pair("aloe", left, right, truth, 1.0 / smaller)


def _shrunk(view: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.float64]:
    """Means of what falls into each pixel; width and height, px."""
    return np.asarray(cv2.resize(view, size, interpolation=cv2.INTER_AREA), np.float64)


def _true_pair(
    name: str,
    left: NDArray[np.floating],
    right: NDArray[np.floating],
    truth: NDArray[np.float64],
    step_px: float,
) -> TruePair:
    """The left view is the reference; a disparity of 0 is unknown."""
    frames = np.rint(np.stack([left, right])).astype(np.uint8)
    views = RectifiedViews(frames, np.array([0.0, 1.0]), np.zeros(2), 0)
    range_px = 0.0, float(np.ceil(_WIDER * truth.max()))
    known = np.where(truth > 0.0, truth, np.nan)
    return TruePair(Scene(name, views, known, range_px, border_px=0), step_px)
