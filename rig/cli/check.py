"""`rig check`: the pre-flight of a rig."""

import shutil
import textwrap
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, CalibrationChoice, DatabaseUrl, MaybeProfileName, Overrides
from rig.cli.output import show, show_json, tell

if TYPE_CHECKING:
    from rig.check.items import Item, Status
    from rig.cli.check_bundle import Bundle

_LOG_WIDTH = 110
_NAME_WIDTH = 14
_MARK = {"pass": "pass", "warn": "WARN", "fail": "FAIL", "skip": "skip"}


def check(
    profile_name: MaybeProfileName = None,
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
    bundle: Annotated[
        Path | None,
        typer.Option(
            "--bundle",
            metavar="FILE.zip",
            help="Also write what support needs into this new file; without PROFILE that alone.",
            show_default=False,
        ),
    ] = None,
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
    from rig.cli.check_bundle import Bundle

    pack = Bundle(bundle, database)
    if profile_name is None:
        pack.write_alone(as_json=as_json)
        return
    from rig.check.check import check_on_rig
    from rig.check.items import worst
    from rig.check.scene_look import check_scene
    from rig.profile.load import load_profile
    from rig.stored import RunChoice

    items: list[Item] = []
    with pack.written_if_it_fails():
        profile = pack.profile = load_profile(profile_name, overrides or ())
        choice = RunChoice(database, calibration)
        asked = (
            check_scene(profile, choice)
            if scene
            else check_on_rig(profile, choice, tell, moves=not no_move)
        )
        with closing(asked) as answers:
            for item in answers:
                items.append(item)
                pack.log += _lines(item)
                if not as_json:
                    _show(item)
    verdict = worst([item.status for item in items])
    _conclude(profile.name, verdict, items, pack, as_json=as_json)
    if verdict == "fail":
        names = ", ".join(item.name for item in items if item.status == "fail")
        tell(f"rig: {profile.name} is not ready{'' if scene else ' to sweep'}: {names}")
        tell_next("check, fail", as_json=as_json, profile=profile_name)
        raise typer.Exit(3)
    stays = (no_move or scene) and profile.stage is not None
    tell_next("check, no move" if stays else "check", as_json=as_json, profile=profile_name)


def _conclude(
    name: str, verdict: "Status", items: "Sequence[Item]", pack: "Bundle", *, as_json: bool
) -> None:
    """Say what came of all items together, and write the bundle."""
    counts = {s: sum(item.status == s for item in items) for s in _MARK}
    counted = ", ".join(f"{count} {status}" for status, count in counts.items())
    pack.log += ["", counted]
    packed = pack.written()
    if not as_json:
        show()
        show(counted)
        packed.show()
        return
    content = {"profile": name, "verdict": verdict, "counts": counts}
    show_json({**content, "items": [_as_dict(item) for item in items], **packed.as_dict()})


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
    for line in _lines(item, max(60, shutil.get_terminal_size((110, 24)).columns)):
        show(line)


def _lines(item: "Item", width: int = _LOG_WIDTH) -> list[str]:
    head = f"{_MARK[item.status]}  {item.name:<{_NAME_WIDTH}} "
    indent = " " * len(head)
    return [
        line
        for first, then, text in (
            (head, indent, item.found),
            (f"{indent}-> ", indent, item.advice),
        )
        for line in textwrap.wrap(
            text, width, initial_indent=first, subsequent_indent=then, break_on_hyphens=False
        )
    ]
