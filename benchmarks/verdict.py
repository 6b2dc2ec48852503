"""How often the verdict of a calibration blames faultless pictures, and how often it sees a fault.

Rigs of three 1280 x 800 cameras, 75 mm H-V, with corners rendered and fitted as those of real
pictures, over blurs and noises from almost none to much. Faults have twice the size that costs
0.1 % of the depth at 1 m: such a view stands 0.15 mm beside its place along the baseline from
half-way on, or shows the board 0.15 mm aside; blurred corners scatter by 0.13 px.

Run: python -m benchmarks.verdict [--rigs 200] [--first 0]
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from benchmarks.calibration_corners import Picture, rendered_sightings
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.sighting import Sighting
from tests.support.calibration_scene import HEIGHT, WIDTH, Scene, flat_board_mm, random_scene

NAMES = ("centre", "right", "low")
STEPS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
CODES = ("unsynchronised", "moved", "bumped", "blurred", "swapped", "square-size")
FAULT_MM = 0.15
"""Twice 0.1 % of the baseline: what it costs in depth, at any distance."""
FAULT_PX = 0.13
"""Twice 0.1 % of the disparity at 1 m: what the corners of a blurred picture scatter by."""


@dataclass
class Rig:
    """One draw."""

    scene: Scene
    like: Picture
    seed: int

    @property
    def count(self) -> int:
        """Number of pictures."""
        return len(self.scene.poses)

    @property
    def half(self) -> int:
        """Index of the middle picture."""
        return self.count // 2

    def but(self, other: Scene, view: int, pictures: range) -> list[Sighting]:
        """The same, but for one view in some pictures, which show another scene."""
        wrong = rendered_sightings(other, 3000 + self.seed, self.like, pictures, [view])
        right = [s for s in self.right if s.view != view or s.picture not in pictures]
        return right + wrong

    @cached_property
    def right(self) -> list[Sighting]:
        """See `sightings`."""
        return rendered_sightings(self.scene, 1000 + self.seed, self.like)


def draw(seed: int) -> Rig:
    """A rig, 12 to 24 pictures, blur 0.35 to 1.3 px, noise 0.1 to 4 levels (even in logarithm)."""
    rng = np.random.default_rng(7000 + seed)
    scene = random_scene(seed, int(rng.integers(12, 25)))
    if rng.uniform() < 0.5:
        scene = replace(scene, bend_mm=(0.0, 0.0, 0.0))
    blur_px, noise = np.exp(rng.uniform(np.log([0.35, 0.1]), np.log([1.3, 4.0])))
    return Rig(scene, Picture(float(blur_px), float(noise)), seed)


def solve(sightings: list[Sighting]) -> Calibration:
    """Calibrate as `rig calibrate` does, the lens given."""
    sizes = [(WIDTH, HEIGHT)] * 3
    return solve_rig(sightings, flat_board_mm(), sizes, NAMES, 0, lens="brown5", steps=STEPS)


def faultless(rig: Rig) -> list[Sighting]:
    return rig.right


def bumped(rig: Rig) -> list[Sighting]:
    """One camera stands aside, along its baseline, from half-way on."""
    cameras = list(rig.scene.cameras)
    aside = np.add(cameras[1].centre_mm, (FAULT_MM, 0.0, 0.0))
    cameras[1] = replace(cameras[1], centre_mm=tuple(aside))
    return rig.but(replace(rig.scene, cameras=tuple(cameras)), 1, range(rig.half, rig.count))


def late(rig: Rig) -> list[Sighting]:
    """One view shows the board aside, elsewhere in every picture."""
    return rig.but(_aside(rig, range(rig.count)), 1, range(rig.count))


def moved(rig: Rig) -> list[Sighting]:
    """One view shows the board aside in one picture."""
    return rig.but(_aside(rig, range(rig.half, rig.half + 1)), 1, range(rig.half, rig.half + 1))


def blurred(rig: Rig) -> list[Sighting]:
    """The corners of all views scatter in two pictures."""
    rng = np.random.default_rng(rig.seed)
    bad = (rig.half, rig.half + 1)
    return [
        replace(s, xy_px=s.xy_px + rng.normal(0.0, FAULT_PX, s.xy_px.shape))
        if s.picture in bad
        else s
        for s in rig.right
    ]


def _aside(rig: Rig, pictures: range) -> Scene:
    rng = np.random.default_rng(rig.seed)
    poses = list(rig.scene.poses)
    for picture in pictures:
        angle_rad = rng.uniform(0, 2 * np.pi)
        aside = FAULT_MM * np.array([np.cos(angle_rad), np.sin(angle_rad), 0.0])
        middle_mm = tuple(np.add(poses[picture].middle_mm, aside))
        poses[picture] = replace(poses[picture], middle_mm=middle_mm)
    return replace(rig.scene, poses=tuple(poses))


CASES: dict[str, tuple[Callable[[Rig], list[Sighting]], tuple[str, ...]]] = {
    "faultless": (faultless, ()),
    "bumped": (bumped, ("bumped",)),
    "late in every picture": (late, ("unsynchronised", "moved")),
    "moved in one picture": (moved, ("moved",)),
    "blurred in two pictures": (blurred, ("blurred",)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigs", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args()
    told = {case: Counter[str]() for case in CASES}
    for seed in range(asked.first, asked.first + asked.rigs):
        rig = draw(seed)
        for case, (make, wanted) in CASES.items():
            codes = {reason.code for reason in solve(make(rig)).verdict.reasons} & set(CODES)
            is_right = bool(codes & set(wanted)) if wanted else not codes
            told[case].update(codes)
            told[case]["right"] += is_right
            if not is_right:
                print(f"{case}, rig {seed}: {sorted(codes)}, {rig.like}", file=sys.stderr)
    print(f"share of {asked.rigs} rigs that are told so, %")
    print(f"{'':26s}" + "".join(f"{code:>16s}" for code in ("right", *CODES)))
    for case, counts in told.items():
        shares = (100.0 * counts[code] / asked.rigs for code in ("right", *CODES))
        print(f"{case:26s}" + "".join(f"{share:16.1f}" for share in shares))


if __name__ == "__main__":
    main()
