"""`rig.open`: from a profile to a camera that gives depth."""

import os
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Literal

from rig.curve import Curve
from rig.devices import Camera, Clock
from rig.hardware.opening import open_camera
from rig.live.camera import DepthCamera
from rig.profile.kinds import ScanKeeping
from rig.profile.load import load_profile
from rig.stored import Run, RunChoice, RunCurve, open_run, optics_of


def open_depth_camera(
    profile: str | os.PathLike[str],
    *,
    database: str | None = None,
    curve: int | Curve | Literal["newest", "none"] = "newest",
    calibration: int | Literal["newest", "none"] = "newest",
    overrides: Sequence[str] = (),
) -> DepthCamera:
    """Look up what a rig uses; `with` then opens its device.

    Args:
        profile: a name in `calib_profiles` or the path of a TOML file.
        database: SQLAlchemy URL; None for `RIG_DATABASE`, else the user's own.
        curve: number of a stored curve; `newest` good one of the rig, or, where it has none at all,
            the one that its calibration gives by itself, or that of the device once it is open; a
            curve that `rig.load_curve` gave, of which nobody can check that it belongs to this rig;
            or `none`: frames then have slopes only.
        calibration: number of a stored calibration; `newest` good one of the rig, if any; or `none`
            for pictures as they are.
        overrides: `key.path=value` each, as `--set` of the command line.

    Raises:
        ConfigError: no such profile, or the calibration does not fit it.
        CurveError: the curve does not fit the rig or the calibration.
        StoreError: no such database, calibration or curve.
    """
    rig = load_profile(os.fspath(profile), overrides)
    brought = RunCurve(None, curve, None) if isinstance(curve, Curve) else None
    wanted = "none" if isinstance(curve, Curve) else curve
    if (wanted, calibration) == ("none", "none"):  # nothing is looked up: no database is touched
        used = None if brought is None else brought.within(rig)
        return depth_camera(Run(rig, optics_of(rig, None), used))
    from rig.database import open_store

    choice = RunChoice(database, None if calibration == "newest" else str(calibration), wanted)
    with open_store(choice.database, absent=choice.absent) as store:
        run = open_run(store, rig, choice.calibration, choice.curve)
    if brought is not None:
        run = replace(run, curve=brought.within(rig), awaits=None)
    return depth_camera(run)


def depth_camera(run: Run, scans: ScanKeeping | None = None) -> DepthCamera:
    """Return the camera of a run, not yet open.

    Args:
        run: what the rig uses.
        scans: where a camera that moves keeps what it takes; None in memory.
    """

    def door() -> AbstractContextManager[tuple[Camera, Clock]]:
        return open_camera(run.profile, scans=scans)

    return DepthCamera(run, door)
