"""Judgement of a camera that moves: when it rests after a move, and whether the light stays."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.check.items import Item, failed, graded
from rig.check.picture_shift import Grey, shift_px, smooth
from rig.devices import Camera, Clock
from rig.errors import DeviceError
from rig.frames import Frame, MultiView
from rig.profile import ScanCameraConfig
from rig.scan import MovedCamera

WATCHED_S = 6.0
"""So long a camera is watched after its longest move, or twice its settling time."""
_LOOK_EVERY_S = 0.05
_AT_REST = 0.25
"""Part of the motion that a scan allows (`max_motion_px`) which a camera at rest may still make."""
_MARGIN = 0.75
"""Part of the settling time within which it should rest."""
_END_S = 1.0
"""The last part of the watch: what is called rest."""
_MOST_BLUR_PX = 0.05
_DRIFT_PCT = (2.0, 10.0)
"""Changes of the light within a scan that go without a word, and that are too much: they are taken
out between takes of the reference, as if the light changed evenly there."""


@dataclass(frozen=True, slots=True)
class Ringing:
    """What the picture did after the camera had arrived."""

    times_s: NDArray[np.float64]
    """(N,) middle of each exposure after the arrival."""
    shift_px: NDArray[np.float64]
    """(N, 2) of the picture against the picture at rest."""
    sharpness: NDArray[np.float64]
    """(N,) mean square of the edges over that at rest."""

    def rest_s(self, limit_px: float) -> float | None:
        """Return the time from which the picture stays within a limit; None where it never does."""
        off = np.flatnonzero(np.hypot(*self.shift_px.T) > limit_px)
        if not len(off):
            return 0.0
        if off[-1] + 1 >= len(self.times_s):
            return None
        return float(self.times_s[off[-1] + 1])

    def speed_px_s(self, after_s: float) -> float:
        """Return the fastest motion of the picture from a time on; 0 where nobody looked."""
        since = self.times_s >= after_s
        steps = np.diff(self.shift_px[since], axis=0)
        gaps = np.diff(self.times_s[since])
        return float((np.hypot(*steps.T) / gaps).max(initial=0.0)) if len(gaps) else 0.0


def watch_arrival(camera: Camera, clock: Clock, watched_s: float, timeout_s: float) -> Ringing:
    """Watch the picture of a camera that has just arrived.

    The last second is rest; every earlier picture is laid over its mean by one least-squares step,
    which is exact for motion well below the width of an edge.

    Args:
        camera: that is carried, open.
        clock: of the bench.
        watched_s: for how long.
        timeout_s: longest wait for a picture.

    Raises:
        DeviceError: the camera failed.
    """
    arrived_s = clock.now_s()
    frames: list[Frame] = []
    while clock.now_s() - arrived_s < watched_s:
        frames.append(camera.grab(timeout_s).frames[0])
        clock.sleep_s(_LOOK_EVERY_S - 1e-3)
    times_s = np.array([frame.timestamp_s - arrived_s for frame in frames])
    pictures = [smooth(frame) for frame in frames]
    resting = [p for p, t in zip(pictures, times_s, strict=True) if t >= watched_s - _END_S]
    rest = np.mean(resting or pictures[-1:], axis=0)
    at_rest = _edges2(resting[-1] if resting else pictures[-1])
    return Ringing(
        times_s,
        np.array([shift_px(picture, rest) for picture in pictures]),
        np.array([_edges2(picture) / at_rest for picture in pictures]),
    )


def judge_rest(config: ScanCameraConfig, camera: MovedCamera, clock: Clock) -> Iterator[Item]:
    """Make the longest move of the row, watch the picture come to rest, and judge the settling."""
    end_mm, home_mm, _ = camera.row_mm
    watched_s = max(WATCHED_S, 2.0 * config.settle_s + _END_S)
    try:
        camera.go(end_mm)
        camera.go(home_mm)
        ringing = watch_arrival(camera.carried, clock, watched_s, config.inner.timeout_s)
        exposure_s = camera.carried.grab(config.inner.timeout_s).frames[0].exposure_s
    except DeviceError as error:
        yield failed("settle", error)
        return
    yield judge_settle(config, ringing)
    if exposure_s is None:
        yield Item("blur", "skip", "the camera does not tell how long it exposes")
    else:
        yield judge_blur(config, ringing, exposure_s)


def judge_settle(config: ScanCameraConfig, ringing: Ringing) -> Item:
    """Judge whether a scan waits until its camera rests."""
    limit_px = _AT_REST * config.max_motion_px
    rest_s = ringing.rest_s(limit_px)
    if rest_s is None:
        return Item(
            "settle",
            "fail",
            f"after a move the picture does not come to rest within {limit_px:.3f} px in "
            f"{ringing.times_s[-1]:.1f} s",
            "look for what shakes the camera, or for a scene that moves",
        )
    needed_s = rest_s / _MARGIN
    early = ringing.sharpness[ringing.times_s <= rest_s]
    softest = float(early.min(initial=1.0))
    status = graded(rest_s, warn_above=_MARGIN * config.settle_s, fail_above=config.settle_s)
    return Item(
        "settle",
        status,
        f"the picture rests (within {limit_px:.3f} px) {rest_s:.2f} s after a move, until then its "
        f"edges fall to {100 * softest:.0f} %; camera.settle_s is {config.settle_s:.2f} s",
        "" if status == "pass" else f"set camera.settle_s = {np.ceil(10 * needed_s) / 10:.1f}",
        {"rest_s": rest_s, "needed_s": needed_s, "sharpness": softest},
    )


def judge_blur(config: ScanCameraConfig, ringing: Ringing, exposure_s: float) -> Item:
    """Judge how far the picture still moves while it is exposed."""
    speed_px_s = ringing.speed_px_s(config.settle_s)
    blur_px = speed_px_s * exposure_s
    status = graded(blur_px, warn_above=_MOST_BLUR_PX, fail_above=config.max_motion_px)
    return Item(
        "blur",
        status,
        f"at most {speed_px_s:.2f} px/s once settled, {blur_px:.4f} px in an exposure of "
        f"{1e3 * exposure_s:.1f} ms",
        "" if status == "pass" else "settle longer, or expose shorter",
        {"speed_px_s": speed_px_s, "blur_px": blur_px},
    )


def judge_scans(multiviews: Sequence[MultiView]) -> Iterator[Item]:
    """Judge the light over whole scans, and say what a camera that moves does not do."""
    drifts = [one.scan.facts.brightness_drift for one in multiviews if one.scan is not None]
    if drifts:
        drift_pct = 100.0 * max(drifts)
        warn_pct, fail_pct = _DRIFT_PCT
        status = graded(drift_pct, warn_above=warn_pct, fail_above=fail_pct)
        yield Item(
            "light",
            status,
            f"brightness changes by {drift_pct:.2f} % within a scan, which is taken out",
            "" if status == "pass" else "let the lamps warm up, shut out daylight",
            {"drift_pct": drift_pct},
        )
    for name in ("skew", "rate", "drops"):
        yield Item(name, "skip", "the camera moves from view to view, it does not stream")


def _edges2(picture: Grey) -> float:
    across, down = np.gradient(picture)
    return float(np.mean(across**2 + down**2))
