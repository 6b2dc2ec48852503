"""A capture with its effects: what is stored, the camera, the folder."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rig.capture.capture import CaptureRequest, CaptureSummary, capture_depth
from rig.capture.drift_log import DriftLog
from rig.capture.drift_watch import DriftWatch, look_of
from rig.capture.output import WantedOutput
from rig.capture.scans import owned_scans, require_scan, scans_of
from rig.database import open_store
from rig.live.opening import depth_camera
from rig.profile import Profile
from rig.progress import Progress, Tell
from rig.stored import RunChoice, new_folder, newer_curve, open_run
from rig.unit import unit_of


def capture_on_rig(
    profile: Profile,
    choice: RunChoice,
    request: CaptureRequest,
    progress: Progress,
    tell: Tell,
    more: Callable[[CaptureRequest, Path, DriftLog], tuple[WantedOutput, ...]] = lambda *_: (),
) -> CaptureSummary:
    """Look up what the rig uses, open its camera, and capture.

    A capture that ends by itself is written into a new folder beside the database where the request
    names none.

    Args:
        profile: the rig.
        choice: which calibration and which curve.
        request: how long, and where maps go.
        progress: told of every measured multi-view.
        tell: see `capture_depth`; also told how far the curve can be trusted, before the first
            multi-view, and of a curve that took the place of the one in use.
        more: returns further outputs, given the request with its folder, the folder for what they
            write (that of the request, or a new one), and the series of looks at the cameras.

    Raises:
        ConfigError: the calibration does not fit the rig.
        CurveError: the curve does not fit the rig, or its rows miss otherwise than then.
        DeviceError: the camera failed; what was written before is kept.
        OwnedError: another program scans with this rig.
        StoreError: no such calibration or curve, or folder or recording cannot be written.
    """
    require_scan(profile, request)
    with open_store(choice.database, absent=choice.absent) as store:
        run = open_run(store, profile, choice.calibration, choice.curve)
        if request.folder is None and request.ends:
            request = replace(request, folder=new_folder(store, "captures", profile.name))
        log = DriftLog()
        kept = request.folder or new_folder(store, "captures", profile.name)
        request = replace(request, outputs=(*request.outputs, *more(request, kept, log)))
        scans = scans_of(store, run.profile, request)
        with owned_scans(store, profile.name, scans), depth_camera(run, scans) as camera:
            for notice in camera.run.notices:
                tell(notice)
            unit = unit_of(run.profile, camera.identity)
            with DriftWatch(look_of(camera.run, store, unit, log), tell) as watch:
                summary = capture_depth(camera, request, progress, tell, watch.watched)
        newer = newer_curve(store, run, choice.curve)
        if newer is not None:
            used = "no curve" if summary.curve is None else summary.curve.title
            tell(f"rig: curve {newer} was made meanwhile; this capture used {used} to its end")
        return summary
