"""Rectification: how fast pictures are brought together, and how far edges move by it.

`python -m benchmarks.rectification` prints ms per multi-view (5 views of 640 x 400, the cameras of
the profile `sim-real`) beside OpenCV's `remap` on the same maps in the same process, and the error
of both on a slanted edge whose place is known in closed form.
"""

import statistics
import time
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray
from rig_sim.clock import VirtualClock
from rig_sim.world import World
from scipy.special import erf

from rig.arrays import Float
from rig.epipolar.resample import Resampler
from rig.geometry.rectification import Rectification, rectify
from rig.profile.load import load_profile
from tests.support.cameras import Slide
from tests.support.geometry import true_geometry

ROUNDS = 41
BLURS_PX = (0.6, 0.7, 0.8, 1.0)
PARTS = np.arange(0.05, 1.0, 0.05)
SIZE = (120, 200)
ANGLE_RAD = np.radians(7.0)
MIDDLE_PX = (99.3, 59.6)


def main() -> None:
    rectification = sim_real()
    maps = [rectification.raw_map_px(view) for view in range(5)]
    images = [
        np.random.default_rng(view).integers(0, 256, rectification.shape, dtype=np.uint8)
        for view in range(5)
    ]
    ours = Resampler(maps, [rectification.shape] * 5)
    theirs = [place.astype(np.float32) for place in maps]
    print("5 views of 640 x 400, ms per multi-view: wall / CPU, median of", ROUNDS)
    shown("own, 4 x 4 Lagrange", lambda: ours(images))
    shown("cv2.remap, cubic", lambda: [remapped(i, m) for i, m in zip(images, theirs, strict=True)])
    print("edge moved by resampling, px: largest over fractions of a pixel / rms")
    for blur_px in BLURS_PX:
        row = "  ".join(
            f"{name} {np.abs(moved).max():.4f} / {np.sqrt(np.mean(moved**2)):.4f}"
            for name, moved in (
                ("own", shifts_px(blur_px, own)),
                ("cv2.remap", shifts_px(blur_px, remapped)),
            )
        )
        print(f"  blur {blur_px:.1f} px: {row}")


def sim_real() -> Rectification:
    profile = load_profile("sim-real", ("world.renderer=analytic",))
    world = World(profile, clock=VirtualClock(), carriage=Slide(), scene="board")
    return rectify(true_geometry(profile, world.moment(0.0)), profile.pitch_mm)


def shown(name: str, run: Callable[[], object]) -> None:
    run()
    walls_s: list[float] = []
    cpus_s: list[float] = []
    for _ in range(ROUNDS):
        wall_s, cpu_s = time.perf_counter(), time.process_time()
        run()
        walls_s.append(time.perf_counter() - wall_s)
        cpus_s.append(time.process_time() - cpu_s)
    wall, cpu = (1e3 * statistics.median(times) for times in (walls_s, cpus_s))
    print(f"  {name}: {wall:.1f} / {cpu:.1f}, least {1e3 * min(walls_s):.1f}")


def own(image: NDArray[np.generic], places: NDArray[np.floating]) -> NDArray[np.float32]:
    return Resampler([np.asarray(places, np.float64)], [SIZE])([image])[0]


def remapped(image: NDArray[np.generic], places: NDArray[np.floating]) -> NDArray[np.float32]:
    grey = np.asarray(image, np.float32)
    found = cv2.remap(
        grey, np.asarray(places, np.float32), np.empty(0, np.float32), cv2.INTER_CUBIC
    )
    return np.asarray(found, np.float32)


def shifts_px(
    blur_px: float,
    resample: Callable[[NDArray[np.generic], NDArray[np.floating]], NDArray[np.float32]],
) -> Float:
    """How far a slanted edge moves, for every part of a pixel that the map moves by."""
    grid = np.stack(np.meshgrid(np.arange(float(SIZE[1])), np.arange(float(SIZE[0]))), axis=-1)
    image = edge(place(grid), blur_px).astype(np.float32)
    found: list[float] = []
    for part in PARTS:
        to_raw = grid + part
        at = place(to_raw)
        miss = resample(image, to_raw) - edge(at, blur_px)
        rate = (edge(at + 1e-3, blur_px) - edge(at - 1e-3, blur_px)) / 2e-3
        near = (np.abs(at) < 5.0) & (grid > 3).all(axis=-1)
        near &= (grid[..., 0] < SIZE[1] - 5) & (grid[..., 1] < SIZE[0] - 5)
        found.append(float((miss * rate)[near].sum() / (rate**2)[near].sum()))
    return np.array(found)


def place(at: Float) -> Float:
    """Distance from the edge."""
    x, y = at[..., 0] - MIDDLE_PX[0], at[..., 1] - MIDDLE_PX[1]
    return x * np.cos(ANGLE_RAD) + y * np.sin(ANGLE_RAD)


def edge(x: Float, blur_px: float) -> Float:
    """A step seen through a Gaussian lens by square pixels."""
    within = (np.arange(64) + 0.5) / 64 - 0.5
    blurred = 0.5 * (1.0 + erf((x[..., None] + within) / (np.sqrt(2.0) * blur_px)))
    return 200.0 * blurred.mean(axis=-1)


if __name__ == "__main__":
    main()
