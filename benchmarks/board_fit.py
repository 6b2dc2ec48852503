"""Board slope and corners against truth and against the Cramer-Rao bound.

Run: python -m benchmarks.board_fit [--poses 200]
"""

import argparse
import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar import RectifiedViews
from rig.epipolar.board.fit import fit_board_slope
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import find_corners
from tests.support.board_images import BoardScene, blurred, digitised
from tests.support.slope_bound import slope_bound_px

X_STEPS = np.array([0.0, -1.1, 0.93, 0.0, 0.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -1.05, 0.96])
GAINS = (1.0, 1.02, 0.98, 1.01, 0.97)
BLURS_PX = (0.6, 0.9)
NOISES = (1.0, 2.0, 5.0)
BOARD = Checkerboard(9, 6, 25.0)


@dataclass
class Cell:
    """Errors of one blur and noise."""

    slope_px: list[float] = field(default_factory=list[float])
    track_px: list[float] = field(default_factory=list[float])
    sigma_px: list[float] = field(default_factory=list[float])
    bound_px: list[float] = field(default_factory=list[float])
    corner_px: list[Float] = field(default_factory=list[Float])
    corners_s: list[float] = field(default_factory=list[float])
    fit_s: list[float] = field(default_factory=list[float])

    def line(self) -> str:
        """The columns that `main` names."""
        error, bound = np.array(self.slope_px), np.array(self.bound_px)
        return (
            f"{_rms(error / bound):9.3f} {_rms(np.array(self.track_px) / bound):9.3f} "
            f"{_rms(error / np.array(self.sigma_px)):9.3f} {_rms(error) * 1e3:9.3f} "
            f"{np.mean(error) * 1e3:9.3f} {_rms(np.concatenate(self.corner_px)):9.4f} "
            f"{np.median(self.corners_s) / len(X_STEPS) * 1e3:9.1f} "
            f"{np.median(self.fit_s) * 1e3:9.1f}"
        )


def random_scene(rng: np.random.Generator) -> BoardScene:
    """A pose that a hand-held or stage-carried board may have, all of it in every view."""
    return BoardScene(
        distance_mm=float(rng.uniform(450, 1100)),
        offset_mm=(float(rng.uniform(-25, 25)), float(rng.uniform(-15, 15))),
        tilt_deg=(
            float(rng.uniform(-25, 25)),
            float(rng.uniform(-25, 25)),
            float(rng.uniform(-25, 25)),
        ),
        background_contrast=float(rng.uniform(0, 40)),
    )


def measure(poses: int) -> dict[tuple[float, float], Cell]:
    """Fit every pose in every cell."""
    cells = {(blur, noise): Cell() for blur in BLURS_PX for noise in NOISES}
    rng = np.random.default_rng(2026)
    for _ in range(poses):
        scene = random_scene(rng)
        sharp = [scene.sharp(x, y) for x, y in zip(X_STEPS, Y_STEPS, strict=True)]
        for blur in BLURS_PX:
            clean = [blurred(view, blur) for view in sharp]
            for noise in NOISES:
                _measure_one(cells[blur, noise], scene, clean, noise, rng)
    return cells


def _measure_one(
    cell: Cell,
    scene: BoardScene,
    clean: list[NDArray[np.float32]],
    noise: float,
    rng: np.random.Generator,
) -> None:
    images = np.stack(
        [
            digitised(view, noise=noise, rng=rng, gain=gain)
            for view, gain in zip(clean, GAINS, strict=True)
        ]
    )
    begun = time.perf_counter()
    corners = [find_corners(image, BOARD) for image in images]
    found = time.perf_counter()
    fit = fit_board_slope(RectifiedViews(images, X_STEPS, Y_STEPS, 0), corners)
    cell.fit_s.append(time.perf_counter() - found)
    cell.corners_s.append(found - begun)
    truth = scene.plane()[0]
    cell.slope_px.append(fit.slope_px - truth)
    cell.track_px.append(fit.corner_slope_px - truth)
    cell.sigma_px.append(fit.sigma_px)
    cell.bound_px.append(slope_bound_px(clean[0], fit, X_STEPS, Y_STEPS, noise))
    for view, (x, y) in zip(corners, zip(X_STEPS, Y_STEPS, strict=True), strict=True):
        cell.corner_px.append((view.xy_px - scene.corners(x, y)).ravel())


def _rms(values: Float) -> float:
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=200)
    poses = int(parser.parse_args().poses)
    print(f"{poses} random poses, 5 views in a cross, 640 x 400, board {BOARD}, gains +-3 %")
    print(
        "rms error over the Cramer-Rao bound: joint fit, corner tracks; over the fit's own sigma;"
    )
    print(
        "rms and mean error in 1e-3 px per step; corners: rms px per coordinate; ms: per view, fit"
    )
    print(
        f"{'blur':>5} {'noise':>5} {'joint':>9} {'tracks':>9} {'/sigma':>9} {'rms':>9} {'mean':>9} "
        f"{'corner':>9} {'ms/view':>9} {'ms fit':>9}"
    )
    for (blur, noise), cell in measure(poses).items():
        print(f"{blur:5.1f} {noise:5.0f} {cell.line()}", flush=True)


if __name__ == "__main__":
    main()
