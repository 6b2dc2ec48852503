"""Judgement of repeated pictures of one scene: everything that needs no motion."""

from collections.abc import Iterator, Mapping, Sequence

from rig.check.items import Item
from rig.check.locks import judge_locks
from rig.check.noise import judge_noise
from rig.check.pictures import (
    judge_board,
    judge_exposure,
    judge_focus,
    judge_likeness,
)
from rig.check.stills import measure_stills
from rig.check.timing import judge_settling
from rig.frames import MultiView
from rig.optics.target import target_of
from rig.profile import CharucoConfig, CheckerboardConfig, Profile


def judge_scene(
    profile: Profile,
    identity: Mapping[str, str],
    multiviews: Sequence[MultiView],
    *,
    at_mm: float | None,
) -> Iterator[Item]:
    """Yield what repeated pictures of one scene tell.

    Args:
        profile: the rig.
        identity: what the opened camera says of itself.
        multiviews: of a scene at rest.
        at_mm: where the stage carried the board before them; None where it was left alone.
    """
    target = profile.target
    has_squares = isinstance(target, CheckerboardConfig | CharucoConfig)
    board = target_of(target) if has_squares else None
    samples = 5 if profile.sweep is None else profile.sweep.samples
    views = measure_stills(multiviews, board, samples=samples)
    where = "where it stands" if at_mm is None else f"at {at_mm:.1f} mm"
    if target is None:
        yield Item("board", "skip", "the profile has no [target]")
    elif board is None:
        found = f"a target of kind {target.kind} has no squares: it is for rig calibrate"
        yield Item("board", "skip", found)
    else:
        yield judge_board(views, where)
    yield judge_focus(views)
    yield judge_exposure(views)
    yield judge_locks(profile.camera, identity, views)
    if len(multiviews) > 2:
        yield judge_noise(views, profile.camera.noise)
    else:
        yield Item("noise", "skip", f"needs 3 pictures of one scene, found {len(multiviews)}")
    yield judge_likeness(views)
    if at_mm is not None and profile.sweep is not None:
        yield judge_settling(
            views, settle_s=profile.sweep.settle_s, allowed_px=profile.sweep.max_motion_px
        )
