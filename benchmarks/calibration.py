"""Depth error that calibration alone causes, against truth and beside OpenCV on the same corners.

Three 1280 x 800 cameras, 75 mm H-V, 40 ChArUco poses at 0.35 to 1 m, blur 0.7 px, noise 2; every
corner is rendered and fitted.

Run: python -m benchmarks.calibration [--seeds 20]
"""

import argparse
import os
import subprocess
import sys
import time
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.calibration_corners import corner_error_px, rendered_sightings
from rig.arrays import Float
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.bundle.depth_error import DISTANCES_MM, depth_gradient, depth_sigma_mm
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting
from tests.support.calibration_scene import (
    HEIGHT,
    WIDTH,
    Scene,
    flat_board_mm,
    random_scene,
)

NAMES = ("centre", "right", "low")
PAIR = (0, 1)
ALL = (0, 1, 2)


@dataclass
class Tally:
    """Errors over the seeds; lists have one entry per seed."""

    depth_pct: dict[str, list[list[float]]] = field(default_factory=dict[str, list[list[float]]])
    inside: list[NDArray[np.bool_]] = field(default_factory=list[NDArray[np.bool_]])
    stated_pct: list[list[float]] = field(default_factory=list[list[float]])
    rms_px: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    corner_px: list[float] = field(default_factory=list[float])
    scale: list[float] = field(default_factory=list[float])
    solve_s: list[float] = field(default_factory=list[float])
    opencv_s: list[float] = field(default_factory=list[float])

    def add(self, name: str, errors_pct: list[float]) -> None:
        """Keep the errors of one seed."""
        self.depth_pct.setdefault(name, []).append(errors_pct)


def solve(sightings: list[Sighting]) -> Calibration:
    return solve_rig(sightings, flat_board_mm(), [(WIDTH, HEIGHT)] * 3, NAMES, 0, lens="brown5")


def opencv_pair(sightings: list[Sighting]) -> RigGeometry:
    """Run calibrateCamera per view, then stereoCalibrate with these intrinsics fixed."""
    board = flat_board_mm().astype(np.float32)
    by_view = {view: {s.picture: s for s in sightings if s.view == view} for view in PAIR}
    numbers = []
    for view in PAIR:
        own = list(by_view[view].values())
        _, matrix, lens, _, _ = cv2.calibrateCamera(
            [board[s.ids] for s in own],
            [s.xy_px.astype(np.float32) for s in own],
            (WIDTH, HEIGHT),
            np.eye(3),
            np.zeros(5),
        )
        numbers.append((matrix, lens.ravel()[:5]))
    points, left, right = [], [], []
    for picture in sorted(set(by_view[0]) & set(by_view[1])):
        one, other = by_view[0][picture], by_view[1][picture]
        ids, here, there = np.intersect1d(one.ids, other.ids, return_indices=True)
        if len(ids) >= 6:
            points.append(board[ids])
            left.append(one.xy_px[here].astype(np.float32))
            right.append(other.xy_px[there].astype(np.float32))
    (k0, d0), (k1, d1) = numbers
    found = cv2.stereoCalibrate(
        points, left, right, k0, d0, k1, d1, (WIDTH, HEIGHT), flags=cv2.CALIB_FIX_INTRINSIC
    )
    cameras = tuple(
        CameraModel(
            WIDTH, HEIGHT, k[0, 0], k[1, 1], k[0, 2], k[1, 2], "brown5", tuple(map(float, d))
        )
        for k, d in numbers
    )
    place = Pose(np.asarray(found[5], np.float64), np.asarray(found[6], np.float64).ravel())
    return RigGeometry(NAMES[:2], 0, cameras, (Pose.identity(), place))


def depth_errors_mm(
    geometry: RigGeometry, scene: Scene, distance_mm: float, views: tuple[int, ...]
) -> tuple[Float, Float]:
    """Triangulated minus true depth (G,) on a grid, NaN where one view sees it; pixels (G, 2)."""
    camera = scene.cameras[0]
    x, y = np.meshgrid(np.linspace(0, WIDTH - 1, 9), np.linspace(0, HEIGHT - 1, 7))
    pixels = np.stack([x.ravel(), y.ravel()], axis=1)
    points = np.concatenate(
        [(pixels - camera.middle_px) / camera.focal_px, np.ones((len(pixels), 1))], axis=1
    )
    for _ in range(20):  # fixed point: where the true reference camera shows each grid pixel
        miss = pixels - camera.project(points * distance_mm)
        points[:, :2] += miss / camera.focal_px
    points *= distance_mm
    shown = [scene.cameras[view].project(points) for view in views]
    size = np.array([WIDTH, HEIGHT]) - 0.5
    inside = [np.all((u > -0.5) & (u < size), axis=1) for u in shown]
    seen = np.sum(inside, axis=0) >= 2
    at = points.copy()
    for _ in range(6):
        normal, side = np.zeros((len(at), 3, 3)), np.zeros((len(at), 3))
        for view, wanted, weight in zip(views, shown, inside, strict=True):
            here = geometry.project(view, at)
            by = np.stack(
                [(geometry.project(view, at + step) - here) / 1e-4 for step in 1e-4 * np.eye(3)],
                axis=2,
            )
            by[~weight] = 0.0
            off = np.where(weight[:, None], wanted - here, 0.0)
            normal += np.einsum("gai,gaj->gij", by, by)
            side += np.einsum("gai,ga->gi", by, off)
        at[seen] += np.linalg.solve(normal[seen], side[seen][..., None])[..., 0]
    errors = at[:, 2] - points[:, 2]
    errors[~seen] = np.nan
    return errors, pixels


def rms(values: Float) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def measure(seed: int, bend_mm: tuple[float, float, float], tally: Tally) -> None:
    scene = replace(random_scene(seed), bend_mm=bend_mm)
    sightings = rendered_sightings(scene, 1000 + seed)
    tally.corner_px.append(corner_error_px(scene, sightings))
    begun = time.process_time()
    found = solve(sightings)
    tally.solve_s.append(time.process_time() - begun)
    begun = time.process_time()
    pair = opencv_pair(sightings)
    tally.opencv_s.append(time.process_time() - begun)
    tally.rms_px.append((found.rms_px, found.held_out_rms_px))
    tally.scale.append(found.error_scale)
    rows = {"H pair": (found.geometry, PAIR), "H-V": (found.geometry, ALL), "OpenCV": (pair, PAIR)}
    for name, (geometry, views) in rows.items():
        errors = [depth_errors_mm(geometry, scene, z, views)[0] / z * 100 for z in DISTANCES_MM]
        tally.add(name, [rms(e) for e in errors])
        tally.add(f"{name}, median", [float(np.nanmedian(np.abs(e))) for e in errors])
    stated: list[float] = []
    for distance_mm in DISTANCES_MM:
        error, pixels = depth_errors_mm(found.geometry, scene, distance_mm, ALL)
        sigma = depth_sigma_mm(found.geometry, distance_mm, pixels)
        both = np.isfinite(error) & np.isfinite(sigma)
        tally.inside.append(np.abs(error[both]) <= 2 * sigma[both])
        gradient = depth_gradient(found.geometry, distance_mm, pixels, PAIR) / distance_mm * 100
        good = np.isfinite(gradient).all(axis=1)
        covariance = np.asarray(found.geometry.covariance)
        variance = np.einsum("gp,pq,gq->g", gradient[good], covariance, gradient[good])
        stated.append(float(np.sqrt(variance.mean())))
    tally.stated_pct.append(stated)


def report(tally: Tally) -> None:
    print(f"corner error {np.median(tally.corner_px):.4f} px per coordinate")
    inner, outer = np.median(tally.rms_px, axis=0)
    print(f"reprojection rms {inner:.4f} px, held out {outer:.4f} px (two coordinates)")
    print(f"pull of a picture over that of independent errors {np.median(tally.scale):.2f}")
    print(f"{'depth error, %, median over seeds':36s}" + "".join(f"{z:8.0f}" for z in DISTANCES_MM))
    for name, errors in tally.depth_pct.items():
        print(f"{name:36s}" + "".join(f"{v:8.4f}" for v in np.median(errors, axis=0)))
    stated = np.median(tally.stated_pct, axis=0)
    print(f"{'H pair, sigma as stated':36s}" + "".join(f"{v:8.4f}" for v in stated))
    count = len(DISTANCES_MM)
    shares = [np.concatenate(tally.inside[i::count]).mean() for i in range(count)]
    print(f"{'true error within k=2, %':36s}" + "".join(f"{100 * v:8.1f}" for v in shares))
    print(f"over all: {100 * np.concatenate(tally.inside).mean():.1f} %")
    print(
        f"solve {np.median(tally.solve_s):.2f} s, OpenCV pair {np.median(tally.opencv_s):.2f} s "
        "(process time, median)"
    )


def solve_time(pictures: int) -> None:
    """Everything `calibrate` does, lens given and chosen, for many pictures."""
    sightings = random_scene(0, pictures).sightings(1)
    for lens in ("brown5", "auto"):
        begun, clock = time.process_time(), time.perf_counter()
        solve_rig(sightings, flat_board_mm(), [(WIDTH, HEIGHT)] * 3, NAMES, 0, lens=lens)
        print(
            f"{pictures} pictures, {sum(map(len, sightings))} points, lens {lens}: "
            f"{time.process_time() - begun:.2f} s process time, "
            f"{time.perf_counter() - clock:.2f} s on the clock"
        )


BITS = """
import hashlib
from tests.support.calibration_scene import random_scene
from benchmarks.calibration import solve
print(hashlib.sha256(solve(random_scene(0, 20).sightings(1)).to_json().encode()).hexdigest())
"""


def bits() -> None:
    """Solve again in processes with one and two threads of linear algebra."""
    found = {
        subprocess.run(
            [sys.executable, "-c", BITS],
            env=os.environ | {"OPENBLAS_NUM_THREADS": threads, "NUMBA_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for threads in ("1", "2", "2")
    }
    print("same bits in three processes, 1 and 2 threads:", "yes" if len(found) == 1 else "NO")


def main(seeds: int = 20) -> None:
    for bend_mm in ((0.0, 0.0, 0.0), (0.3, -0.1, 0.2)):
        tally = Tally()
        for seed in range(seeds):
            measure(seed, bend_mm, tally)
            print(f"seed {seed} done", file=sys.stderr)
        print(f"\nboard bent by {', '.join(map(str, bend_mm))} mm (X^2, X Y, Y^2), {seeds} seeds")
        report(tally)
    solve_time(120)
    bits()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    main(parser.parse_args().seeds)
