"""Drift before the desk: is a turned view found by one multi-view, as a capture looks?

The rig `sim-real` (five views of 640 x 400 px, misaligned, distorting lenses) looks at its desk.
Its calibration is the truth, known as well as a board tells it (rows to some thousandths of a
pixel). Then one view is turned by 0.02 degrees about x or z, or so far that its rows move by
0.05 px: of the reference and of a view above or below it as well, whose lines run down.

Run: python -m benchmarks.desk_drift [--views right centre bottom] [--frames 1]
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from rig_sim.camera import SimCamera
from rig_sim.clock import VirtualClock
from rig_sim.world import World

from benchmarks.mixed import camera_of
from rig.arrays import Float
from rig.capture.drift_watch import ALARM
from rig.epipolar.scene.drift import scene_drift
from rig.epipolar.scene.look import look
from rig.frames import MultiView
from rig.geometry.rig_geometry import RigGeometry
from rig.profile import Profile
from rig.profile.load import load_profile
from tests.support.cameras import Slide
from tests.support.geometry import true_geometry

_DEG, _ROWS_PX = 0.02, 0.05
_LENS, _TURN, _SHIFT = (0.05, 0.05, 3e-3, 3e-3), 3 * (float(np.radians(3e-4)),), 3 * (0.005,)
"""How sure the calibration is: focal lengths and principal point px, turns rad, places mm."""
Turn = tuple[float, float, float]


def seen(profile: Profile, frames: int) -> tuple[list[MultiView], RigGeometry]:
    """Multi-views of the desk, and where the cameras are."""
    world = World(profile, clock=VirtualClock(), carriage=Slide(), scene="desk")
    with SimCamera(camera_of(profile), world) as camera:
        taken = [camera.grab(5.0) for _ in range(frames)]
    return taken, replace(true_geometry(profile, world.moment(0.0)), stage=None)


def turned(profile: Profile, view: str, turn_deg: Turn) -> Profile:
    """The rig with one view turned."""
    world = profile.world
    if world is None:
        raise TypeError("a profile without a world given")
    error = world.view_errors[view]
    x, y, z = (a + b for a, b in zip(error.rotation_deg, turn_deg, strict=True))
    errors = {**world.view_errors, view: error.model_copy(update={"rotation_deg": (x, y, z)})}
    return profile.model_copy(update={"world": world.model_copy(update={"view_errors": errors})})


def sure(geometry: RigGeometry) -> Float:
    """(P, P) covariance of the calibration; lens terms are known."""
    lenses = [
        number
        for camera in geometry.cameras
        for number in (*_LENS, *(0.0 for _ in camera.coefficients))
    ]
    return np.diag(np.square([*lenses, *(len(geometry.names) - 1) * (*_TURN, *_SHIFT)]))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--views", nargs="+", default=["right", "centre", "bottom"])
    parser.add_argument("--frames", type=int, default=1)
    asked = parser.parse_args(arguments)
    profile = load_profile("sim-real")
    _, geometry = seen(profile, 1)
    rows_deg = float(np.degrees(_ROWS_PX / geometry.cameras[0].fx_px))
    for view in asked.views:
        is_above = abs(next(v.y_steps for v in profile.views if v.name == view)) > 0.0
        turns: dict[str, Turn] = {
            "nothing": (0.0, 0.0, 0.0),
            "pitch": (_DEG, 0.0, 0.0),
            "roll": (0.0, 0.0, _DEG),
            "rows": (0.0, rows_deg, 0.0) if is_above else (rows_deg, 0.0, 0.0),
        }
        for name, turn_deg in turns.items():
            taken, _ = seen(turned(profile, view, turn_deg), asked.frames)
            features = look(geometry, [one.images for one in taken], 255)
            drift = scene_drift(geometry, sure(geometry), features)
            whose = "all" if drift.alone is None else geometry.names[drift.alone]
            is_alarm = drift.probability < ALARM
            print(
                f"{view}, {name}: probability {drift.probability:.1e} ({whose}), "
                f"{'an alarm' if is_alarm else 'no alarm'}",
                flush=True,
            )


if __name__ == "__main__":
    main()
