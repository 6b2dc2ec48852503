"""Real pictures: our calibration beside OpenCV's, on the same corners.

For every set: pictures are split into halves (even, odd). Each half is calibrated and judged on the
other: reprojection of held-out pictures (board pose from all views, as the rig has them) and
epipolar error; then how far apart the two halves put a point at 1 m, where boards were seen and
all over the picture. OpenCV: calibrateCamera
per view, then stereoCalibrate of every view with the reference, intrinsics held.

Run: RIG_SHARED_DATA=/where/data/is python -m benchmarks.calibration_real
"""

import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.calibrate.pictures import recorded_pictures
from rig.calibrate.sight import PictureSightings, all_sightings, sight
from rig.calibrate.stored_pictures import stored_pictures
from rig.errors import CalibrationError
from rig.geometry.bundle import solve_rig
from rig.geometry.bundle.part import nodes_px, part_of_sightings
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting
from rig.hardware.opening import open_camera
from rig.optics.target import target_of
from rig.profile.load import load_profile

SETS = ("checkerboard-stereo", "charuco-4cam")
SHARED = Path(os.environ.get("RIG_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))
AT_MM = 1000.0
_FEWEST_POINTS = 6


@dataclass(frozen=True)
class Pictures:
    """What was found in one set."""

    names: tuple[str, ...]
    points_mm: Float
    sizes_px: tuple[tuple[int, int], ...]
    sightings: list[PictureSightings]


def read(name: str) -> Pictures:
    """Find the target in every picture of a set."""
    profile = stored_pictures(load_profile(name), [str(SHARED / name)], SHARED)
    if profile.target is None:
        sys.exit(f"{name}: has no [target]")
    target = target_of(profile.target)
    with open_camera(profile) as (camera, _):
        sightings = [sight(picture, target) for picture in recorded_pictures(camera)]
    return Pictures(
        tuple(view.name for view in profile.views),
        target.points_mm.reshape(-1, 3),
        sightings[0].sizes_px,
        [one for one in sightings if one.views],
    )


def ours(found: Pictures, sightings: Sequence[Sighting]) -> RigGeometry:
    """Joint bundle adjustment of all views."""
    return solve_rig(
        sightings, found.points_mm, found.sizes_px, found.names, 0, lens="brown5"
    ).geometry


def opencv(found: Pictures, sightings: Sequence[Sighting]) -> RigGeometry:
    """Each view alone, then each pair with the reference."""
    by_view = {
        view: {s.picture: s for s in sightings if s.view == view and len(s) >= _FEWEST_POINTS}
        for view in range(len(found.names))
    }
    cameras: list[tuple[Float, Float]] = []
    for view, size_px in enumerate(found.sizes_px):
        own = list(by_view[view].values())
        _, matrix, bending, _, _ = cv2.calibrateCamera(
            [found.points_mm[s.ids].astype(np.float32) for s in own],
            [s.xy_px.astype(np.float32) for s in own],
            size_px,
            np.eye(3),
            np.zeros(5),
        )
        cameras.append((np.asarray(matrix, np.float64), np.asarray(bending, np.float64).ravel()))
    places = [Pose.identity()]
    places += [
        _pair(found, by_view[0], by_view[view], cameras[0], cameras[view], view)
        for view in range(1, len(found.names))
    ]
    models = tuple(
        CameraModel(
            *found.sizes_px[view], *(float(m[i]) for i in ((0, 0), (1, 1), (0, 2), (1, 2))),
            lens="brown5", coefficients=tuple(float(k) for k in bending[:5]),
        )
        for view, (m, bending) in enumerate(cameras)
    )  # fmt: skip
    return RigGeometry(found.names, 0, models, tuple(places))


def _pair(
    found: Pictures,
    first: dict[int, Sighting],
    last: dict[int, Sighting],
    camera: tuple[Float, Float],
    other: tuple[Float, Float],
    view: int,
) -> Pose:
    points: list[NDArray[np.float32]] = []
    here: list[NDArray[np.float32]] = []
    there: list[NDArray[np.float32]] = []
    for picture in sorted(set(first) & set(last)):
        a, b = first[picture], last[picture]
        ids, i, j = np.intersect1d(a.ids, b.ids, return_indices=True)
        if len(ids) >= _FEWEST_POINTS:
            points.append(found.points_mm[ids].astype(np.float32))
            here.append(a.xy_px[i].astype(np.float32))
            there.append(b.xy_px[j].astype(np.float32))
    solved = cv2.stereoCalibrate(
        points, here, there, *camera, *other, found.sizes_px[view], flags=cv2.CALIB_FIX_INTRINSIC
    )
    return Pose(np.asarray(solved[5], np.float64), np.asarray(solved[6], np.float64))


def held_out_px(found: Pictures, geometry: RigGeometry, sightings: Sequence[Sighting]) -> Float:
    """Distances (N,) of held-out points, the pose of the board alone fitted to all views."""
    try:
        judged = solve_rig(
            sightings, found.points_mm, found.sizes_px, found.names, 0, start=geometry, fixed="all",
            synchronous=True,
        )  # fmt: skip
    except CalibrationError as error:
        sys.exit(f"{error}")
    return np.concatenate([np.linalg.norm(r.residual_px, axis=1) for r in judged.residuals])


def epipolar_px(geometry: RigGeometry, sightings: Sequence[Sighting]) -> Float:
    """Distances (N,) of points from the epipolar line of their partner in the reference view."""
    first = {s.picture: s for s in sightings if s.view == 0}
    apart: list[Float] = []
    for s in sightings:
        if s.view == 0 or s.picture not in first:
            continue
        partner = first[s.picture]
        _, i, j = np.intersect1d(partner.ids, s.ids, return_indices=True)
        if not len(i):
            continue
        camera, pose = geometry.cameras[s.view], geometry.cam_from_reference[s.view]
        ray = np.column_stack([geometry.cameras[0].unproject(partner.xy_px[i]), np.ones(len(i))])
        seen = np.column_stack([camera.unproject(s.xy_px[j]), np.ones(len(j))])
        lines = np.cross(pose.translation_mm, ray @ pose.rotation.T)
        miss = np.abs(np.sum(lines * seen, axis=1)) / np.linalg.norm(lines[:, :2], axis=1)
        apart.append(miss * camera.fx_px)
    return np.concatenate(apart)


def grid_px(found: Pictures) -> Float:
    """(G, 2) pixels all over the reference picture, but for its rim."""
    x, y = np.meshgrid(np.linspace(0.1, 0.9, 9), np.linspace(0.1, 0.9, 7))
    return np.stack([x.ravel(), y.ravel()], axis=1) * found.sizes_px[0]


def seen_px(found: Pictures) -> Float:
    """(G, 2) pixels of the reference picture at which boards were seen."""
    every = all_sightings(found.sightings)
    part = part_of_sightings([s.xy_px for s in every if s.view == 0], found.sizes_px[0])
    return nodes_px(found.sizes_px[0])[part]


def depths_apart_pct(one: RigGeometry, other: RigGeometry, pixels: Float) -> float:
    """Rms difference of depth at pixels (G, 2) of the reference picture, at 1 m, in per cent.

    Points of the one geometry are projected into all views and triangulated with the other.
    """
    camera = one.cameras[0]
    points = np.column_stack([camera.unproject(pixels), np.ones(len(pixels))]) * AT_MM
    wrong: list[float] = []
    for point in points:
        rows: list[Float] = []
        for view, model in enumerate(one.cameras):
            pixel = one.project(view, point[None])
            inside = ((pixel >= 0) & (pixel < (model.width_px, model.height_px))).all()
            if not inside:
                continue
            xy = other.cameras[view].unproject(pixel)[0]
            pose = other.cam_from_reference[view]
            matrix = np.column_stack([pose.rotation, pose.translation_mm])
            rows += [xy[0] * matrix[2] - matrix[0], xy[1] * matrix[2] - matrix[1]]
        if len(rows) < 4 or not np.isfinite(rows).all():
            continue
        homogeneous = np.linalg.svd(np.array(rows) / (1, 1, 1, AT_MM))[2][-1]
        depth_mm = homogeneous[2] / homogeneous[3] * AT_MM
        wrong.append(depth_mm / AT_MM - 1)
    return float(np.sqrt(np.mean(np.square(wrong)))) * 100 if wrong else float("nan")


def main() -> None:
    for name in SETS:
        if not (SHARED / name).is_dir():
            print(f"{name}: not in {SHARED}; set RIG_SHARED_DATA")
            continue
        found = read(name)
        every = all_sightings(found.sightings)
        numbers = sorted({s.picture for s in every})
        halves = [[s for s in every if s.picture in set(numbers[start::2])] for start in (0, 1)]
        print(f"{name}: {len(numbers)} pictures, {sum(map(len, every))} corners")
        for tool in (ours, opencv):
            begun = time.perf_counter()
            solved = tool(found, halves[0]), tool(found, halves[1])
            took_s = time.perf_counter() - begun
            pairs = list(zip(solved, reversed(halves), strict=True))
            apart = np.concatenate([held_out_px(found, g, half) for g, half in pairs])
            lines = np.concatenate([epipolar_px(g, half) for g, half in pairs])
            print(
                f"  {tool.__name__:>7}: held-out rms {np.sqrt(np.mean(apart**2)):.3f} px, median "
                f"{np.median(apart):.3f}; epipolar mean {lines.mean():.3f}, p95 "
                f"{np.percentile(lines, 95):.3f}, max {lines.max():.2f} px; halves apart at 1 m "
                f"{depths_apart_pct(*solved, seen_px(found)):.3f} % where boards were seen, "
                f"{depths_apart_pct(*solved, grid_px(found)):.3f} % over the picture; "
                f"{took_s:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
