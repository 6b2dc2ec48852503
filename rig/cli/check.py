"""`rig check`: the pre-flight of a rig."""

import shutil
import textwrap
from contextlib import closing
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, CalibrationChoice, DatabaseUrl, Overrides, ProfileName
from rig.cli.output import show, show_json, tell

if TYPE_CHECKING:
    from rig.check.items import Item

_NAME_WIDTH = 14
_MARK = {"pass": "pass", "warn": "WARN", "fail": "FAIL", "skip": "skip"}


def check(
    profile_name: ProfileName,
    *,
    no_move: Annotated[
        bool, typer.Option("--no-move", help="Leave the stage where it is; some items are skipped.")
    ] = False,
    scene: Annotated[
        bool,
        typer.Option(
            "--scene",
            help="Only compare an ordinary scene with the calibration: have views turned since?",
        ),
    ] = False,
    calibration: CalibrationChoice = None,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Look at everything that a sweep needs, before it begins.

    Prints pass, warn or fail for every item, with what was found and what to do. The stage is homed
    and moved, unless --no-move or the profile forbids it. Exit code 3 says that an item fails.
    With --scene nothing is moved and no target is needed: what rows tell of the cameras since their
    calibration, kept in the history.
    """
    from rig.check.check import check_on_rig
    from rig.check.items import worst
    from rig.check.scene_look import check_scene
    from rig.profile.load import load_profile
    from rig.stored import RunChoice

    profile = load_profile(profile_name, overrides or ())
    choice = RunChoice(database, calibration)
    items: list[Item] = []
    asked = (
        check_scene(profile, choice)
        if scene
        else check_on_rig(profile, choice, tell, moves=not no_move)
    )
    with closing(asked) as answers:
        for item in answers:
            items.append(item)
            if not as_json:
                _show(item)
    verdict = worst([item.status for item in items])
    counts = {s: sum(item.status == s for item in items) for s in ("pass", "warn", "fail", "skip")}
    if as_json:
        show_json(
            {
                "profile": profile.name,
                "verdict": verdict,
                "counts": counts,
                "items": [_as_dict(item) for item in items],
            }
        )
    else:
        show()
        show(", ".join(f"{count} {status}" for status, count in counts.items()))
    if verdict == "fail":
        names = ", ".join(item.name for item in items if item.status == "fail")
        tell(f"rig: {profile.name} is not ready{'' if scene else ' to sweep'}: {names}")
        tell_next("check, fail", as_json=as_json, profile=profile_name)
        raise typer.Exit(3)
    stays = (no_move or scene) and profile.stage is not None
    tell_next("check, no move" if stays else "check", as_json=as_json, profile=profile_name)


def _as_dict(item: "Item") -> dict[str, object]:
    """Return what `--json` prints of an item."""
    return {
        "item": item.name,
        "status": item.status,
        "found": item.found,
        "advice": item.advice,
        "numbers": dict(item.numbers),
    }


def _show(item: "Item") -> None:
    width = max(60, shutil.get_terminal_size((110, 24)).columns)
    head = f"{_MARK[item.status]}  {item.name:<{_NAME_WIDTH}} "
    indent = " " * len(head)
    for first, then, text in ((head, indent, item.found), (f"{indent}-> ", indent, item.advice)):
        for line in textwrap.wrap(
            text, width, initial_indent=first, subsequent_indent=then, break_on_hyphens=False
        ):
            show(line)
