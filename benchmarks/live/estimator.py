"""Times of the slope estimator beside OpenCV's semi-global matchers, and on one and two threads."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import cv2
import numpy as np

from benchmarks.live.timing import Times, on_threads, race, serial_share, speed_up
from benchmarks.slopes.dino import dino_folder, load_dino
from benchmarks.slopes.scenes import SPARSE, Recipe, make_scene
from rig.compare.baselines import BASELINES
from rig.epipolar import RectifiedViews, SlopeMap, SlopePrior, estimate_slopes

_ROUNDS = 15
_MOTION_PX = np.float32(0.2)
_THREADS = 2
_MATCHERS = {method.name: method.run for method in BASELINES}
_FAST, _FULL = "SGBM-3WAY", "SGBM-HH"
_HEAD = (
    f"{'':34} {'wall':>6} {'cpu':>6} {'caller':>6}   {'wall':>6} {'cpu':>6}   {'wall':>5} "
    f"{'cpu':>5}\n{'':34} {'ms':>6} {'ms':>6} {'ms':>6}   {'ms':>6} {'ms':>6}   {'ratio':>5} "
    f"{'ratio':>5}  goal"
)


@dataclass(frozen=True)
class Given:
    """Views and what to look for in them."""

    views: RectifiedViews
    range_px: tuple[float, float]

    def matcher(self, name: str) -> Callable[[], object]:
        """One of OpenCV's matchers at work on them."""
        return partial(_MATCHERS[name], self.views, self.range_px)

    def searched(self) -> SlopeMap:
        """Slopes of an exhaustive search."""
        return estimate_slopes(self.views, self.range_px)


class Followed:
    """A rig that looks at a still scene: each frame is the hypothesis of the next, as live."""

    def __init__(self, given: Given) -> None:
        self._given = given
        self._last = given.searched()
        self._views = replace(given.views, mending=self._last.mending)

    def frame(self) -> SlopeMap:
        """Slopes of the next frame."""
        last = self._last
        prior = SlopePrior(last.slope_px, np.maximum(last.sigma_px, _MOTION_PX), last.steady)
        self._last = estimate_slopes(self._views, self._given.range_px, prior)
        return self._last


@cache
def cross() -> Given:
    """A cross of five views of 640 x 400, slopes over 80 px."""
    scene = make_scene(Recipe("live", 40, SPARSE))
    return Given(scene.views, scene.range_px)


def large() -> Given:
    """The same, enlarged twice, with noise of its own: 1280 x 800, slopes over 160 px."""
    small = cross()
    random = np.random.default_rng(8)
    images = [
        cv2.resize(image, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC).astype(np.float32)
        for image in small.views.images
    ]
    noisy = np.stack(images) + random.normal(0.0, 2.0, (len(images), *images[0].shape))
    views = replace(small.views, images=np.clip(np.rint(noisy), 0, 255).astype(np.uint8))
    low, high = small.range_px
    return Given(views, (2 * low, 2 * high))


def _print(name: str, ours: Times, other: Times | None, goal: str) -> None:
    row = f"{name:34} {ours.wall_ms:6.1f} {ours.cpu_ms:6.1f} {ours.caller_ms:6.1f}   "
    if other is not None:
        row += f"{other.wall_ms:6.1f} {other.cpu_ms:6.1f}   "
        row += f"{ours.wall_ms / other.wall_ms:5.2f} {ours.cpu_ms / other.cpu_ms:5.2f}"
    else:
        row += " " * 27
    print(f"{row}  {goal}", flush=True)


def _beside(name: str, ours: Callable[[], object], given: Given, matcher: str, goal: str) -> None:
    times = race({"rig": ours, matcher: given.matcher(matcher)}, _ROUNDS)
    _print(name, times["rig"], times[matcher], f"{goal} (beside {matcher})")


def estimator() -> None:
    """Print a row for each goal."""
    print(_HEAD)
    given = cross()
    _beside(
        "5 views 640 x 400, followed", Followed(given).frame, given, _FAST, "25 ms, wall <= 0.7"
    )
    _beside("5 views 640 x 400, exhaustive", given.searched, given, _FULL, "<= 0.5")
    twice = large()
    times = race({"rig": Followed(twice).frame}, _ROUNDS)["rig"]
    _print("5 views 1280 x 800, followed", times, None, "100 ms")
    folder = dino_folder()
    if folder is None:
        print("hci-dino is left out: set RIG_SHARED_DATA to the folder that holds it")
    else:
        scene = load_dino(folder, 0.0)
        dense = Given(scene.views, scene.range_px)
        _beside("hci-dino, 9 + 9 views", dense.searched, dense, _FULL, "<= 3")
    threads()


def threads() -> None:
    """Print what a second thread gains, and what more would, by the serial share."""
    for name, given in (("640 x 400", cross()), ("1280 x 800", large())):
        ways: dict[str, Callable[[], object]] = {}
        for count in (1, _THREADS):
            ways[f"{count}"] = partial(_on, count, Followed(given))
        times = race(ways, _ROUNDS)
        one, two = times["1"], times[f"{_THREADS}"]
        share = serial_share(ways[f"{_THREADS}"], _ROUNDS)
        gains = ", ".join(f"{n}: {speed_up(share, n):.2f}" for n in (2, 4, 8, 16))
        print(
            f"followed {name}: one thread {one.wall_ms:.1f} ms wall, {one.cpu_ms:.1f} ms cpu; two "
            f"{two.wall_ms:.1f} and {two.cpu_ms:.1f}: {one.wall_ms / two.wall_ms:.2f} times faster "
            f"(goal 1.85)\n  serial share {100 * share:.0f} %; on an idle machine, by Amdahl, "
            f"times faster with threads {gains}",
            flush=True,
        )


def _on(count: int, followed: Followed) -> None:
    with on_threads(count):
        followed.frame()
