"""Drift from ordinary scenes: what is found within five seconds, and false alarms in eight hours.

Rendered scenes of a pair (640 x 400 px, f 500 px) whose calibration is the truth, known as well as
a board tells it (rows to some thousandths of a pixel). One view is then turned about x or about z,
or its rows moved; a look of a check is five multi-views of one scene, that of a capture is one.

A capture of eight hours has 960 looks, too many to render. For false alarms, what the true pipeline
leaves of each scene's features is dealt out anew: the parts of a picture (a fifth of it each way)
change places and signs, so that neighbours still err together, and every look has noise of its own
that is no drift. Looks that share nothing but the calibration are the worst case for the least
probability of a day: those at one standing scene err alike, and are as few as there are scenes. The
calibration is off by what its own covariance allows, the same all day. The same figures of rendered
scenes, a day each, stand beside them.

Run: python -m benchmarks.scene_drift [--scenes 4] [--looks 960] [--rendered 12]
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from rig_sim.optics import TrueCamera

from rig.arrays import Float
from rig.capture.drift_watch import ALARM
from rig.check.scene_drift import CHANCE
from rig.epipolar.scene.drift import SceneDrift, scene_drift
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.look import look
from rig.epipolar.scene.numbers import numbers_of, with_numbers
from rig.epipolar.scene.rays import misfit
from rig.epipolar.scene.solve import across_px
from rig.geometry.rig_geometry import RigGeometry
from tests.support.scene_pictures import cards, geometry_of, photographs, true_camera

SIZE_PX, FOCAL_PX = (640, 400), 500.0
SURE = np.diag(
    np.array([*2 * [0.05, 0.05, 3e-3, 3e-3], *3 * [np.radians(3e-4)], *3 * [0.005]]) ** 2
)
FRAMES = 5
PARTS = 5


def cameras(turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> list[TrueCamera]:
    left = true_camera("left", (0.0, 0.0, 0.0), size_px=SIZE_PX, focal_px=FOCAL_PX)
    right = true_camera("right", (75.0, 0.0, 0.0), size_px=SIZE_PX, focal_px=FOCAL_PX)
    return [left, replace(right, rotation_deg=turn_deg)]


def seen(scene: int, turn_deg: tuple[float, float, float], frames: int) -> SceneFeatures:
    """Features of a scene, by the true pipeline."""
    there, surfaces = cameras(turn_deg), cards(scene)
    pictures = [photographs(there, surfaces, 100 * scene + k) for k in range(frames)]
    return look(geometry_of(cameras()), pictures, 255)


def calibrated(day: int) -> RigGeometry:
    """What a calibration may have found of the true cameras, by its covariance."""
    true = geometry_of(cameras())
    away = np.sqrt(np.diag(SURE)) * np.random.default_rng(10_000 + day).standard_normal(len(SURE))
    return with_numbers(true, numbers_of(true) + away)


def judged(features: SceneFeatures, geometry: RigGeometry | None = None) -> SceneDrift:
    return scene_drift(geometry_of(cameras()) if geometry is None else geometry, SURE, features)


def dealt(features: SceneFeatures, random: np.random.Generator) -> SceneFeatures:
    """The features where they should be, with errors of other parts of the picture."""
    geometry = geometry_of(cameras())
    at = misfit(geometry, features)
    across = np.nan_to_num(across_px(at, features)[:, 1])
    across = np.clip(across, *np.percentile(across, [1.0, 99.0]))
    size = np.array(SIZE_PX)
    part = np.clip((features.reference_px * PARTS / size).astype(int), 0, PARTS - 1)
    key = part[:, 1] * PARTS + part[:, 0]
    errors: Float = np.zeros(len(features))
    other, sign = random.permutation(PARTS**2), random.choice([-1.0, 1.0], PARTS**2)
    for one in range(PARTS**2):
        own, theirs = np.flatnonzero(key == one), np.flatnonzero(key == other[one])
        if len(own) and len(theirs):
            errors[own] = sign[one] * across[theirs[np.arange(len(own)) % len(theirs)]]
    moved = features.view_px.copy()
    moved[:, 1] -= at.residual[:, 1] * features.sigma_px[:, 1, None]
    moved[:, 1, 1] += errors
    return replace(features, view_px=moved)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=4)
    parser.add_argument("--looks", type=int, default=960)
    parser.add_argument("--rendered", type=int, default=12)
    parser.add_argument("--day", type=int, default=0)
    asked = parser.parse_args(arguments)
    rows_deg = float(np.degrees(0.05 / FOCAL_PX))
    turns = {
        "nothing": (0.0, 0.0, 0.0),
        "pitch 0.02 deg": (0.02, 0.0, 0.0),
        "roll 0.02 deg": (0.0, 0.0, 0.02),
        "rows 0.05 px": (rows_deg, 0.0, 0.0),
    }
    for name, turn_deg in turns.items():
        for what, frames, limit in (("check", FRAMES, CHANCE), ("capture", 1, ALARM)):
            drifts = [judged(seen(scene, turn_deg, frames)) for scene in range(asked.scenes)]
            chances = [drift.probability for drift in drifts]
            found = sum(chance < limit for chance in chances)
            print(
                f"{name}: probability at most {max(chances, default=1.0):.1e}; a {what} finds "
                f"{found} of {len(chances)}",
                flush=True,
            )
    if asked.rendered:
        told(
            [
                judged(seen(50 + n, turns["nothing"], 1), calibrated(n))
                for n in range(asked.rendered)
            ],
            "rendered looks, a day each",
        )
    if asked.looks:
        kept = [seen(scene, turns["nothing"], 1) for scene in range(max(asked.scenes, 2))]
        geometry = calibrated(asked.day)
        drifts = [
            judged(dealt(kept[n % len(kept)], np.random.default_rng((asked.day, n))), geometry)
            for n in range(asked.looks)
        ]
        told(drifts, f"looks of day {asked.day}")


def told(drifts: Sequence[SceneDrift], of: str) -> None:
    chances = [drift.probability for drift in drifts]
    print(
        f"{len(chances)} {of}, without drift: least probability {min(chances):.1e}, mean "
        f"{np.mean(chances):.2f}, {sum(c < ALARM for c in chances)} false alarms; below 0.1 / 0.01 "
        f"/ 0.001: {[sum(c < limit for c in chances) for limit in (0.1, 0.01, 0.001)]}",
        flush=True,
    )


if __name__ == "__main__":
    main()
