"""Rectification from ordinary scenes: rows of real pairs, and of rendered rigs against their truth.

Real pairs (`oak-d-pairs` of `RIG_SHARED_DATA`) have no truth: corners are found and tracked by
OpenCV, which had no part in the calibration, in the pictures as they come and as they are
rectified; through their vertical offsets goes a quadratic field. Rendered rigs are pairs and angles
of three cameras of 640 x 400 px, each turned by up to two degrees about every axis.

Run: python -m benchmarks.from_scene [--seeds 6]
"""

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.scene.fine import resampler_of
from rig.epipolar.scene.found import FoundGeometry, find_geometry
from rig.epipolar.scene.prior import Sureness
from rig.epipolar.scene.verdict import judge_scene, rows_sigma_of
from rig.geometry.bundle.depth_error import depth_errors
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rectification import rectify
from rig.geometry.rig_geometry import RigGeometry
from tests.support.scene_features import rows_missed_px
from tests.support.scene_pictures import cards, geometry_of, photographs, true_camera
from tests.support.shared_data import SHARED

SURE = Sureness(focal_pct=0.5, centre_px=3.2, turn_deg=2.0, length_pct=0.5, direction_deg=2.0)
PLACES = ((0.0, 0.0, 0.0), (75.0, 0.0, 0.0), (0.0, 75.0, 0.0))
SCENES, MOST_TURN_DEG = 3, 2.0


def rms(values: Float) -> float:
    return float(np.sqrt(np.mean(values**2)))


def tracked(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> tuple[Float, Float]:
    """Corners of the left picture (N, 2), and by how much they lie lower in the right one."""
    sift = cv2.SIFT.create(nfeatures=3000, contrastThreshold=0.01)
    one, looks = sift.detectAndCompute(left, np.full_like(left, 255))
    other, theirs = sift.detectAndCompute(right, np.full_like(right, 255))
    pairs = cv2.BFMatcher(crossCheck=True).match(looks, theirs)
    begin = np.array([one[p.queryIdx].pt for p in pairs], np.float32)
    there = np.array([other[p.trainIdx].pt for p in pairs], np.float32)
    near = np.abs(there - begin)[:, 1] < 8.0
    begin, there = begin[near], there[near].copy()
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        left, right, begin[:, None].copy(), there[:, None].copy(), winSize=(15, 15), maxLevel=0,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )  # fmt: skip
    kept = (status.ravel() == 1) & (np.abs(found[:, 0] - there).max(axis=1) < 2.0)
    return begin[kept].astype(np.float64), (found[kept, 0, 1] - begin[kept, 1]).astype(np.float64)


def quadratic(places: Float, lower: Float) -> tuple[float, float, float]:
    """Rms of a quadratic field, scatter about the rows and about the field, robust."""
    x, y = ((places - places.mean(axis=0)) / 200.0).T
    design = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    weight, found = np.ones(len(x)), np.zeros(6)
    for _ in range(20):
        found = np.linalg.solve(design.T * weight @ design, design.T @ (weight * lower))
        rest = lower - design @ found
        spread = 1.4826 * float(np.median(np.abs(rest)))
        weight = (1.0 + (rest / (3.0 * spread)) ** 2) ** -2
    inner = weight > 0.1
    field = np.asarray(design @ found, np.float64)
    about = 1.4826 * float(np.median(np.abs((lower - field)[inner])))
    return rms(field[inner]), 1.4826 * float(np.median(np.abs(lower[inner]))), about


def real(name: str) -> None:
    """Rectify one of the pairs by itself, and print what its rows were and are."""
    folder = SHARED / "oak-d-pairs"
    told = json.loads((folder / "calibration.json").read_text())
    images = [
        np.asarray(cv2.imread(str(folder / f"{name}_{side}.png"), cv2.IMREAD_GRAYSCALE), np.uint8)
        for side in ("left", "right")
    ]
    camera = CameraModel(640, 480, told["fx"], told["fx"], told["cx0"], told["cy"])
    places = Pose.identity(), Pose(np.eye(3), np.array([-1000.0 * told["baseline_meters"], 0, 0]))
    start = RigGeometry(("left", "right"), 0, (camera, camera), places)
    begun_s = time.process_time()
    found = find_geometry([images], 255, start, SURE)
    took_s = time.process_time() - begun_s
    level = resampler_of(rectify(found.fit.geometry, 75.0))(images)
    mended = np.clip(np.rint(level), 0, 255).astype(np.uint8)
    before, after = quadratic(*tracked(*images)), quadratic(*tracked(mended[0], mended[1]))
    field = found.fields[1]
    if field is None:
        raise AssertionError("a pair has one view besides the reference")
    print(
        f"{name}: quadratic field {before[0]:.3f} -> {after[0]:.3f} px rms; corners scatter "
        f"{after[1]:.3f} px about the rows, {after[2]:.3f} about the field; own features: smooth "
        f"{field.rms_px:.3f} px, scatter {field.scatter_px:.3f} / {field.about_px:.3f} px; "
        f"{int(found.fit.fits.sum())} features, lens terms {'found' if found.before else 'kept'}, "
        f"{took_s:.1f} s; {verdict_of(found)}"
    )


def verdict_of(found: FoundGeometry) -> str:
    at = {error.distance_mm: error.picture_pct for error in depth_errors(found.fit.geometry)}
    return (
        f"{judge_scene(found, 'stated')}; rows known to {rows_sigma_of(found):.3f} px, depth at "
        f"1 m to {at[1000.0]:.1f} % (k=2)"
    )


def rendered(seed: int, views: int) -> float:
    """Rectify a rendered rig; print and return by how much rows truly miss, px rms."""
    random = np.random.default_rng(seed)
    cameras = [
        replace(
            true_camera("abc"[view], PLACES[view], size_px=(640, 400), focal_px=500.0),
            rotation_deg=tuple(random.uniform(-MOST_TURN_DEG, MOST_TURN_DEG, 3).tolist()),
        )
        for view in range(views)
    ]
    pictures = [photographs(cameras, cards(10 * seed + k), k) for k in range(SCENES)]
    found = find_geometry(pictures, 255, geometry_of(cameras, turned=False), SURE)
    missed_px = rms(rows_missed_px(found.fit.geometry, geometry_of(cameras)))
    print(
        f"rendered, {views} views, seed {seed}: rows miss {missed_px:.4f} px; {verdict_of(found)}"
    )
    return missed_px


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=6)
    asked = parser.parse_args(arguments)
    if (SHARED / "oak-d-pairs").is_dir():
        for name in ("desk", "toy", "stairs"):
            real(name)
    for views in (2, 3) if asked.seeds else ():
        missed = [rendered(seed, views) for seed in range(asked.seeds)]
        print(
            f"rendered, {views} views: median {np.median(missed):.4f}, worst {max(missed):.4f} px"
        )


if __name__ == "__main__":
    main()
