"""How well a slider brings its camera back to one place from both sides, by the picture."""

import math
from dataclasses import dataclass

import numpy as np

from rig.check.items import Item, failed, graded
from rig.check.picture_shift import Grey, shift_px, smooth
from rig.check.stage import SMALL_SHARE
from rig.devices import Clock
from rig.errors import DeviceError
from rig.profile import Profile, ScanCameraConfig
from rig.scan import MovedCamera

_ARRIVALS = 3
"""From each side, in turns."""
_SETTLINGS = 2.0
"""Waits for the picture: what still rings after one would pass for play, as each side rings alike.
"""
_STEP_MM = 0.5
"""A move whose shift of the picture tells pixels per mm: well below a pixel in most scenes."""


@dataclass(frozen=True, slots=True)
class Return:
    """Where a camera was when it was sent to one place again and again, mm along the row."""

    play_mm: float
    """Coming from the far end minus coming from the near end."""
    play_sigma_mm: float
    spread_mm: float
    """1 sigma among arrivals from one side, the picture's own noise included."""


def returns(near_px: list[float], far_px: list[float], px_per_mm: float) -> Return:
    """Turn shifts of the picture into mm.

    Args:
        near_px: at arrivals from the near end, three or more.
        far_px: at arrivals from the far end, three or more.
        px_per_mm: how the picture shifts with the camera; not 0.
    """
    near, far = np.array(near_px) / px_per_mm, np.array(far_px) / px_per_mm
    free = len(near) + len(far) - 2
    variance = (np.sum((near - near.mean()) ** 2) + np.sum((far - far.mean()) ** 2)) / free
    return Return(
        play_mm=float(far.mean() - near.mean()),
        # A variance of few arrivals is unsure: that of Student's t takes it into account.
        play_sigma_mm=math.sqrt(variance * (1.0 / len(near) + 1.0 / len(far)) * free / (free - 2)),
        spread_mm=math.sqrt(variance),
    )


def judge_play(profile: Profile, camera: MovedCamera, clock: Clock) -> Item:
    """Send the camera to its reference from both ends of the row, and look where it stands.

    What the stage's own approach (`approach_mm`) takes out is not seen; with an approach of 0 the
    play itself is.
    """
    config = profile.camera
    near_mm, home_mm, far_mm = camera.row_mm
    if not isinstance(config, ScanCameraConfig) or home_mm in (near_mm, far_mm):
        return Item("play", "skip", "the reference is an end of the row: it has one side")
    try:
        found = _measured(config, camera, clock)
    except DeviceError as error:
        return failed("play", error)
    if found is None:
        return Item(
            "play", "skip", "the picture does not shift when the camera moves: it shows no edges"
        )
    # A place that is off by so much makes depth wrong by this share, over the whole row.
    allowed_mm = 0.01 * profile.quality.holdout_rms_pct * (far_mm[0] - near_mm[0])
    worst_mm = max(abs(found.play_mm) / 2.0, found.spread_mm)
    status = graded(worst_mm, warn_above=SMALL_SHARE * allowed_mm, fail_above=allowed_mm)
    return Item(
        "play",
        status,
        f"from far minus from near {1e3 * found.play_mm:+.1f} +- "
        f"{2e3 * found.play_sigma_mm:.1f} um (k=2), spread {1e3 * found.spread_mm:.1f} um "
        f"(1 sigma) of {2 * _ARRIVALS} arrivals; "
        f"allowed {1e3 * allowed_mm:.0f} um",
        "" if status == "pass" else "raise stages.camera.approach_mm, or look for what is loose",
        {"play_mm": found.play_mm, "spread_mm": found.spread_mm},
    )


def _measured(config: ScanCameraConfig, camera: MovedCamera, clock: Clock) -> Return | None:
    near_mm, home_mm, far_mm = camera.row_mm

    def looked(*way_mm: tuple[float, ...]) -> Grey:
        for places_mm in way_mm:
            camera.go(places_mm)
        clock.sleep_s(_SETTLINGS * config.settle_s)
        return smooth(camera.carried.grab(config.inner.timeout_s).frames[0])

    first = looked(near_mm, home_mm)
    aside_mm = (home_mm[0] + min(_STEP_MM, (far_mm[0] - home_mm[0]) / 2.0), *home_mm[1:])
    step_px = shift_px(looked(near_mm, aside_mm), first)[0]
    px_per_mm = step_px / (aside_mm[0] - home_mm[0])
    if not math.isfinite(px_per_mm) or px_per_mm == 0.0:
        return None
    near_px: list[float] = []
    far_px: list[float] = []
    for _ in range(_ARRIVALS):
        far_px.append(shift_px(looked(far_mm, home_mm), first)[0])
        near_px.append(shift_px(looked(near_mm, home_mm), first)[0])
    return returns(near_px, far_px, px_per_mm)
