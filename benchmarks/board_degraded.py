"""Board slope under what cameras do to pictures, against truth and against its own sigma.

The poses of `benchmarks.board_fit`, five views in a cross, edges blurred by 0.9 px and noise of 1
grey level unless a row says otherwise. Sigma is honest where rms of error / sigma is 0.8 to 1.25.

Run: python -m benchmarks.board_degraded [--poses 30] [--only NAME ...]
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.board_fit import BOARD, GAINS, X_STEPS, Y_STEPS, random_scene
from rig.arrays import Float
from rig.epipolar import RectifiedViews
from rig.epipolar.board.fit import fit_board_slope
from rig.targets.corners import find_corners
from tests.support.board_degradations import (
    banded,
    compressed,
    skewed,
    tilted_light,
    vignetted,
)
from tests.support.board_images import blurred, digitised

Grey = NDArray[np.float32]
Pictures = NDArray[np.uint8]
Sharp = list[Grey]
Degrade = Callable[[Sharp, np.random.Generator], Pictures]

BLUR_PX, DEFOCUS_PX, NOISE = 0.9, 1.5, 1.0


def _taken(clean: list[Grey], rng: np.random.Generator, noise: float = NOISE) -> Pictures:
    return np.stack(
        [
            digitised(view, noise=noise, rng=rng, gain=gain)
            for view, gain in zip(clean, GAINS, strict=True)
        ]
    )


def _clean(sharp: Sharp) -> list[Grey]:
    return [blurred(view, BLUR_PX) for view in sharp]


def _jpeg(quality: int) -> Degrade:
    def degrade(sharp: Sharp, rng: np.random.Generator) -> Pictures:
        return np.stack([compressed(view, quality) for view in _taken(_clean(sharp), rng)])

    return degrade


def _vignettes(sharp: Sharp, rng: np.random.Generator) -> Pictures:
    lit = [
        vignetted(view, rng.uniform(0.2, 0.4), rng.uniform(-40.0, 40.0, 2))
        for view in _clean(sharp)
    ]
    return _taken(lit, rng)


def _gain_across(sharp: Sharp, rng: np.random.Generator) -> Pictures:
    lit = [tilted_light(view, rng.uniform(-0.3, 0.3, 2)) for view in _clean(sharp)]
    return _taken(lit, rng)


def _bands(sharp: Sharp, rng: np.random.Generator) -> Pictures:
    return _taken([banded(view, 2.0, rng) for view in _clean(sharp)], rng)


def _defocused(sharp: Sharp, rng: np.random.Generator) -> Pictures:
    return _taken([blurred(view, float(np.hypot(BLUR_PX, DEFOCUS_PX))) for view in sharp], rng)


def _one_defocused(sharp: Sharp, rng: np.random.Generator) -> Pictures:
    clean = _clean(sharp)
    clean[1] = blurred(sharp[1], float(np.hypot(BLUR_PX, DEFOCUS_PX)))
    return _taken(clean, rng)


def _median(sharp: Sharp, rng: np.random.Generator) -> Pictures:
    return np.stack(
        [np.asarray(cv2.medianBlur(view, 3), np.uint8) for view in _taken(_clean(sharp), rng, 3.0)]
    )


def _coma(sharp: Sharp, rng: np.random.Generator) -> Pictures:
    clean = _clean(sharp)
    clean[1] = skewed(clean[1], 0.15, 1.5)
    return _taken(clean, rng)


DEGRADATIONS: dict[str, Degrade] = {
    "none": lambda sharp, rng: _taken(_clean(sharp), rng),
    "jpeg 90": _jpeg(90),
    "jpeg 70": _jpeg(70),
    "jpeg 40": _jpeg(40),
    "vignettes 20-40 %": _vignettes,
    "gain across": _gain_across,
    "row bands 2": _bands,
    "all defocused 1.5": _defocused,
    "one defocused 1.5": _one_defocused,
    "noise 3, median 3": _median,
    "coma in one view": _coma,
}


@dataclass
class Row:
    """Errors and sigmas under one degradation, px per step."""

    joint_px: list[float] = field(default_factory=list[float])
    joint_sigma_px: list[float] = field(default_factory=list[float])
    tracks_px: list[float] = field(default_factory=list[float])
    tracks_sigma_px: list[float] = field(default_factory=list[float])

    def line(self) -> str:
        """The columns that `main` names."""
        return " ".join(
            f"{_rms(np.array(error)) * 1e3:9.3f} {np.mean(error) * 1e3:9.3f} "
            f"{_rms(np.array(error) / np.array(sigma)):9.3f}"
            for error, sigma in (
                (self.joint_px, self.joint_sigma_px),
                (self.tracks_px, self.tracks_sigma_px),
            )
        )


def samples(
    poses: int, names: list[str], seed: int = 2027
) -> Iterator[tuple[str, float, Pictures]]:
    """Degradation, true slope at the board's centre, and pictures of each pose."""
    rng = np.random.default_rng(seed)
    for _ in range(poses):
        scene = random_scene(rng)
        sharp = [scene.sharp(x, y) for x, y in zip(X_STEPS, Y_STEPS, strict=True)]
        # A generator of its own for each, so that a row does not depend on what else is asked for.
        own = rng.spawn(len(DEGRADATIONS))
        for (name, degrade), dice in zip(DEGRADATIONS.items(), own, strict=True):
            if name in names:
                yield name, float(scene.plane()[0]), degrade(sharp, dice)


def measure(poses: int, names: list[str]) -> dict[str, Row]:
    """Fit every pose under every degradation."""
    rows = {name: Row() for name in names}
    for name, truth_px, images in samples(poses, names):
        corners = [find_corners(image, BOARD) for image in images]
        fit = fit_board_slope(RectifiedViews(images, X_STEPS, Y_STEPS, 0), corners)
        row = rows[name]
        row.joint_px.append(fit.slope_px - truth_px)
        row.joint_sigma_px.append(fit.sigma_px)
        row.tracks_px.append(fit.corner_slope_px - truth_px)
        row.tracks_sigma_px.append(fit.corner_sigma_px)
    return rows


def _rms(values: Float) -> float:
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=30)
    parser.add_argument("--only", nargs="*", choices=list(DEGRADATIONS), metavar="NAME")
    told = parser.parse_args()
    names = list(told.only or DEGRADATIONS)
    print(f"{told.poses} random poses, 5 views in a cross, 640 x 400, board {BOARD}, gains +-3 %")
    print(
        "joint fit, then corner tracks: rms and mean error in 1e-3 px per step, rms of error over"
    )
    print(f"own sigma (known to {70 / np.sqrt(told.poses):.0f} %)")
    titles = ("rms", "mean", "/sigma") * 2
    print(f"{'':20}" + " ".join(f"{title:>9}" for title in titles))
    for name, row in measure(told.poses, names).items():
        print(f"{name:20}{row.line()}", flush=True)


if __name__ == "__main__":
    main()
