"""The board where it happens to stand: what one picture tells of it, and what stays open."""

from collections.abc import Iterator

from rig.check.bench import see
from rig.check.carried_board import judge_curve, judge_places
from rig.check.items import Item
from rig.check.request import CheckRequest, missing_sections
from rig.devices import Stage
from rig.errors import DeviceError, RigError
from rig.frames import MultiView
from rig.optics.target import target_of

CARRIED = ("settling", "curve", "reach", "repeatability")
"""Items that need the board at a known distance."""


def judge_standing_board(
    request: CheckRequest, stage: Stage | RigError | None, multiview: MultiView, why: str
) -> Iterator[Item]:
    """Judge what one picture tells where the board happens to stand, and say why it stands."""
    profile = request.profile
    target = profile.target
    if target is None or profile.sweep is None or stage is None or isinstance(stage, RigError):
        absent = [f"the profile has no [{section}]" for section in missing_sections(profile)]
        reason = ", ".join(absent) or "the stage does not answer, see there"
        yield from (Item(name, "skip", reason) for name in CARRIED)
        return
    yield Item("settling", "skip", why)
    try:
        position_mm = stage.position_mm
    except DeviceError as error:
        yield from (Item(name, "skip", error.found, error.advice) for name in CARRIED[1:])
        return
    board = see(request.run.optics, target_of(target), multiview, position_mm)
    yield judge_curve(profile, request.run.optics, board, request.curve)
    yield judge_places(profile, [board])
    yield Item("repeatability", "skip", why)
