"""Is what separates two halves of real pictures chance? The same pictures, drawn again.

All pictures of a set are calibrated, and what comes out is taken for the truth of a simulation:
cameras and their places, poses of the board, how far it moved between the views of each picture,
the scatter of each point. From it pictures are drawn with errors of their own, halved at random,
and calibrated by us and by OpenCV, as `benchmarks.calibration_real` does with the real ones.

Run: RIG_SHARED_DATA=/where/data/is python -m benchmarks.calibration_twins [--splits 8] [--draws 40]
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from benchmarks.calibration_real import (
    AT_MM,
    SETS,
    SHARED,
    Pictures,
    depths_apart_pct,
    grid_px,
    opencv,
    read,
    seen_px,
)
from rig.arrays import Float
from rig.calibrate.sight import all_sightings
from rig.errors import CalibrationError
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.bundle.depth_error import depth_sigma_mm
from rig.geometry.bundle.result import Residuals
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting

Halves = tuple[RigGeometry, RigGeometry]


@dataclass
class Apart:
    """Differences of depth at 1 m between two halves, %, a number a split."""

    pixels: Float
    """(G, 2) of the reference picture, where depths are compared."""
    ours: list[float] = field(default_factory=list[float])
    stated: list[float] = field(default_factory=list[float])
    """1 sigma of ours."""
    opencv: list[float] = field(default_factory=list[float])

    def add(self, halves: Halves, theirs: Halves) -> None:
        """Compare two halves, solved by us and by OpenCV."""
        self.ours.append(depths_apart_pct(*halves, self.pixels))
        self.opencv.append(depths_apart_pct(*theirs, self.pixels))
        one_mm, other_mm = (depth_sigma_mm(half, AT_MM, self.pixels) for half in halves)
        sigma_mm = np.hypot(one_mm, other_mm)
        self.stated.append(float(np.sqrt(np.nanmean(sigma_mm**2))) / AT_MM * 100)

    def print(self, name: str) -> None:
        """One line of the table."""
        ours, theirs, stated = map(np.array, (self.ours, self.opencv, self.stated))
        print(
            f"  {name:>37}: {len(ours)} splits, halves apart "
            + ", ".join(
                f"{tool} {np.median(row):.2f} (rms {np.sqrt(np.mean(row**2)):.2f}) %"
                for tool, row in (("rig", ours), ("OpenCV", theirs))
            )
            + f"; rig over its stated sigma {np.sqrt(np.mean((ours / stated) ** 2)):.2f} rms, "
            f"{np.median(ours / stated):.2f} median; rig nearer in {np.mean(ours < theirs):.0%}",
            flush=True,
        )


@dataclass
class Splits:
    """Halves of one set, compared where boards were seen and all over the picture."""

    found: Pictures
    seen: Apart
    whole: Apart

    @classmethod
    def of(cls, found: Pictures) -> "Splits":
        """None yet."""
        return cls(found, Apart(seen_px(found)), Apart(grid_px(found)))

    def add(self, sightings: Sequence[Sighting], order: Sequence[int]) -> None:
        """Calibrate every other picture of an order, and the rest; nothing where neither can be."""
        halves = [[s for s in sightings if s.picture in set(order[k::2])] for k in (0, 1)]
        try:
            one, other = (_solved(self.found, half).geometry for half in halves)
            theirs = opencv(self.found, halves[0]), opencv(self.found, halves[1])
        except (CalibrationError, cv2.error) as error:
            print(f"  left out: {error}")
            return
        self.seen.add((one, other), theirs)
        self.whole.add((one, other), theirs)

    def print(self, name: str) -> None:
        """Two lines."""
        self.seen.print(f"{name}, where boards were seen")
        self.whole.print(f"{name}, whole picture")


def _solved(found: Pictures, sightings: Sequence[Sighting]) -> Calibration:
    return solve_rig(sightings, found.points_mm, found.sizes_px, found.names, 0, lens="brown5")


def _drawn(found: Calibration, rng: np.random.Generator) -> list[Sighting]:
    """All sightings, each of a board that has moved and with points that scatter."""
    index = {picture: n for n, picture in enumerate(found.pictures)}
    return [_sighting(found, one, index[one.picture], rng) for one in found.residuals]


def _sighting(found: Calibration, one: Residuals, index: int, rng: np.random.Generator) -> Sighting:
    points_mm = found.warp.bent_mm(found.points_mm)
    middle_mm = points_mm.mean(axis=0)
    board = found.reference_from_board[index]
    turned, shift_mm = np.zeros(3), np.zeros(3)
    if found.motion is not None:
        scale = found.motion.picture_scale[index]
        turned = rng.normal(0.0, found.motion.turn_rad * scale, 3)
        shift_mm = rng.normal(0.0, found.motion.shift_mm * scale, 3)
    own = Pose.from_vectors(turned, shift_mm).rotation @ board.rotation
    world_mm = (points_mm[one.ids] - middle_mm) @ own.T + board.apply(middle_mm[None]) + shift_mm
    shown_px = found.geometry.project(one.view, world_mm)
    scatter_px = rng.standard_normal(shown_px.shape) * one.sigma_px[:, None]
    return Sighting(one.picture, one.view, one.ids, shown_px + scatter_px, one.sigma_px)


def _order(pictures: Sequence[int], rng: np.random.Generator) -> list[int]:
    return rng.permutation(np.array(pictures)).tolist()


def study(name: str, splits: int, draws: int) -> None:
    """Print how far halves of one set are apart, as they are and drawn again."""
    found = read(name)
    every = all_sightings(found.sightings)
    whole = _solved(found, every)
    print(f"{name}: {len(whole.pictures)} pictures")
    rng = np.random.default_rng(1)
    real, again = Splits.of(found), Splits.of(found)
    real.add(every, whole.pictures)  # even and odd
    for _ in range(splits - 1):
        real.add(every, _order(whole.pictures, rng))
    real.print("as they are")
    for _ in range(draws):
        again.add(_drawn(whole, rng), _order(whole.pictures, rng))
    again.print("drawn again")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--splits", type=int, default=8)
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--sets", nargs="+", choices=SETS, default=SETS)
    asked = parser.parse_args()
    for name in asked.sets:
        if not (SHARED / name).is_dir():
            print(f"{name}: not in {SHARED}; set RIG_SHARED_DATA")
            continue
        study(name, asked.splits, asked.draws)


if __name__ == "__main__":
    main()
