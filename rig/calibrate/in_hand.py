"""A target in the hand: which of the live pictures are worth keeping."""

from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager, nullcontext

import numpy as np

from rig.calibrate.pictures import Picture
from rig.calibrate.sight import PictureSightings, sight
from rig.devices import Camera, Clock
from rig.errors import SceneMovedError
from rig.geometry.sighting import Sighting
from rig.progress import Progress
from rig.targets import Target

STILL_PX = 0.3
"""Largest motion of the corners between two pictures of a target at rest."""
_NEW_SHARE = 0.04
"""A pose is new if corners moved by this share of the picture's width since every kept one."""
_PAUSE_S = 0.3
"""Between two pictures of which the second shows whether the target rests."""


def pictures_in_hand(
    camera: Camera,
    clock: Clock,
    target: Target,
    kept: Sequence[PictureSightings],
    *,
    first: int,
    timeout_s: float,
    patience_s: float,
    progress: Progress,
    watch: Callable[[Picture, PictureSightings, bool], None] = lambda *_: None,
    deferred: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> Generator[tuple[Picture, PictureSightings]]:
    """Yield pictures in which a target rests where it has not been yet.

    Views of one picture may be exposed a little apart; a target at rest does not mind.

    Args:
        camera: open.
        clock: of the bench.
        target: what to look for.
        kept: pictures that are there already.
        first: number of the first new picture.
        timeout_s: longest wait for a multi-view.
        patience_s: ends when nothing new has come for so long.
        progress: told of every picture, kept or not, how many are kept.
        watch: given every picture, what it shows, and whether the target moved.
        deferred: context in which an interrupt waits until the picture is stored.
    """
    pictures = list(kept)
    before: PictureSightings | None = None
    number, since_s = first, clock.now_s()
    while clock.now_s() - since_s < patience_s:
        with deferred():
            try:
                picture = Picture(number, camera.grab(timeout_s))
            except SceneMovedError:
                progress(len(pictures), "moving")
                before = None
                continue
            now = sight(picture, target)
            moving = not _is_scan(picture) and (before is None or motion_px(before, now) > STILL_PX)
            shown = f"target in {len(now.views)} of {len(now.by_view)} views"
            progress(len(pictures), f"{shown}, moving" if moving else shown)
            watch(picture, now, moving)
            if now.views and not moving and _is_new(now, pictures):
                pictures.append(now)
                yield picture, now
                number, since_s = number + 1, clock.now_s()
        before = now
        clock.sleep_s(_PAUSE_S)


def _is_scan(picture: Picture) -> bool:
    """Whether the camera has proved that everything was at rest: a scan takes its time."""
    return picture.multiview.scan is not None


def motion_px(first: PictureSightings, last: PictureSightings) -> float:
    """Largest rms motion of the corners that a view shows in both pictures; infinite for none."""
    return max(_motions_px(first, last), default=float("inf"))


def _is_new(now: PictureSightings, pictures: Sequence[PictureSightings]) -> bool:
    wanted_px = _NEW_SHARE * now.sizes_px[0][0]
    return all(
        max(_motions_px(now, one), default=float("inf")) > wanted_px
        for one in pictures
        if one.stage_mm is None
    )


def _motions_px(first: PictureSightings, last: PictureSightings) -> list[float]:
    others = {sighting.view: sighting for sighting in last.sightings}
    pairs = [(s, others[s.view]) for s in first.sightings if s.view in others]
    return [motion for motion in (_motion_px(*pair) for pair in pairs) if motion is not None]


def _motion_px(first: Sighting, last: Sighting) -> float | None:
    _, here, there = np.intersect1d(first.ids, last.ids, return_indices=True)
    if not len(here):
        return None
    moved = np.linalg.norm(first.xy_px[here] - last.xy_px[there], axis=1)
    return float(np.sqrt(np.mean(moved**2)))
