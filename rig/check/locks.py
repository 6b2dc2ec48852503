"""Judgement of the locks: exposure, gain and focus must not change by themselves."""

from collections.abc import Mapping, Sequence

from rig.check.items import Item, Status, graded, worst
from rig.check.stills import ViewStills
from rig.profile import CameraConfig, ScanCameraConfig

SAME_EXPOSURE = 0.01
"""Relative difference of two exposure times that are one setting; devices round."""
STEADY, FLICKERING = 0.02, 0.1
"""Change of the mean brightness between pictures of a scene at rest."""

_LOCKS = {"exposure_s": "exposure", "gain": "gain", "focus": "focus"}
"""Keys of cameras that leave a setting alone where the profile does not say it."""


def judge_locks(
    camera: CameraConfig, identity: Mapping[str, str], views: Sequence[ViewStills]
) -> Item:
    """Judge what the profile locks, what the device reports, and what the pictures show.

    Args:
        camera: the profile's camera.
        identity: what the opened camera says of itself, with its controls where it has any.
        views: repeated pictures of each view.
    """
    statuses: list[Status] = []
    found: list[str] = []
    advice: list[str] = []
    free = unlocked(camera, identity)
    if free:
        statuses.append("warn")
        found.append(f"left to the camera: {', '.join(_LOCKS[key.split('.')[-1]] for key in free)}")
        keys = ", ".join(f"camera.{key}" for key in free)
        advice.append(f"set {keys}: what changes by itself spoils the curve")
    for view in views:
        times_s = view.exposures_s
        if times_s and times_s[-1] > times_s[0] * (1.0 + SAME_EXPOSURE):
            statuses.append("fail")
            low_ms, high_ms = 1e3 * times_s[0], 1e3 * times_s[-1]
            found.append(f"{view.view}: exposure went from {low_ms:.2f} to {high_ms:.2f} ms")
            advice.append(f"{view.view}: switch automatic exposure off")
    reported = [v for v in views if v.exposures_s]
    if reported:
        times_ms = sorted({f"{1e3 * v.exposures_s[0]:.2f}" for v in reported})
        found.append(f"exposure of {', '.join(times_ms)} ms reported")
    else:
        found.append("the camera does not report its exposure")
    # Lamps drift while a camera moves from view to view: that is judged over whole scans.
    if not camera.is_scan:
        change = max((view.brightness_change for view in views), default=0.0)
        steady = graded(change, warn_above=STEADY, fail_above=FLICKERING)
        statuses.append(steady)
        found.append(f"brightness steady within {change:.1%}")
        if steady != "pass":
            advice.append("look for lamps that flicker, daylight, or automatic exposure and gain")
    return Item("locks", worst(["pass", *statuses]), "; ".join(found), "; ".join(advice))


def unlocked(camera: CameraConfig, identity: Mapping[str, str]) -> list[str]:
    """Return the settings that the camera has, the profile could lock, and does not.

    Keys below `camera`; of a camera that moves they are those of the camera that is carried, as
    `inner.gain`.
    """
    if isinstance(camera, ScanCameraConfig):  # the camera that is carried has the settings
        inner = unlocked(camera.inner, identity)
        return [f"inner.{key}" for key in inner]
    fields = type(camera).model_fields
    # An array says this for each of its cameras, under `VIEW.controls`.
    has = " ".join(text for key, text in identity.items() if key.split(".")[-1] == "controls")
    return [
        key
        for key, control in _LOCKS.items()
        if key in fields and getattr(camera, key) is None and control in has.lower()
    ]
