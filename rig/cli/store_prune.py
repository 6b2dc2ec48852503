"""`rig store prune`: pictures of what is old go, numbers stay."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl, finite
from rig.cli.output import show, show_json, table, tell
from rig.cli.store_result import (
    album_as_dict,
    album_row,
    capture_as_dict,
    capture_row,
    prunable_as_dict,
    prunable_row,
    size_in_words,
)

if TYPE_CHECKING:
    from rig.database import Store
    from rig.store.prune import PruneRequest


class KindChoice(StrEnum):
    """What loses its pictures."""

    SWEEPS = "sweeps"
    ALBUMS = "albums"
    CAPTURES = "captures"


class VerdictChoice(StrEnum):
    """How a sweep, or a calibration, ended."""

    PASSED = "passed"
    MISSED = "missed"
    FAILED = "failed"


def prune_store(
    *,
    kinds: Annotated[
        list[KindChoice] | None,
        typer.Option(
            "--of",
            help="Whose pictures: of sweeps, albums (of calibrations), captures; may be repeated. "
            "Default: sweeps.",
            show_default=False,
        ),
    ] = None,
    older_than_days: Annotated[
        float | None,
        typer.Option(
            "--older-than",
            metavar="DAYS",
            min=0.0,
            help="Only what ended so long ago.",
            callback=finite,
            show_default=False,
        ),
    ] = None,
    rig: Annotated[
        str | None, typer.Option("--rig", metavar="NAME", help="Only of this rig.")
    ] = None,
    verdict: Annotated[
        VerdictChoice | None,
        typer.Option("--verdict", help="Only what ended so; captures have none."),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do it; without, it is only told.")] = False,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Remove the images of old sweeps and calibrations; slopes, curves and calibrations stay.

    Captures go as a whole: those without --out, which lie beside the database. Never what is still
    to be gone on with or that a program works on. What was pruned is told by history, verify and
    fit, and is no damage. Without --yes nothing is removed.
    """
    if older_than_days is None and rig is None and verdict is None:
        raise typer.BadParameter("say whose images: --older-than, --rig, --verdict")
    from rig.database import open_store
    from rig.store.prune import PruneRequest

    before = None if older_than_days is None else _days_ago(older_than_days)
    wanted = PruneRequest(before, rig, None if verdict is None else cast("Any", verdict.value))
    content: dict[str, object] = {"pruned": yes}
    lines: list[str] = []
    refused: list[str] = []
    with open_store(database, absent="refused") as store:
        for kind in dict.fromkeys(kinds or [KindChoice.SWEEPS]):
            found, more = _PRUNED[kind](store, wanted, yes)
            refused += more
            content[kind.value] = [found.as_dict(one) for one in found.things]
            size = size_in_words(sum(one.bytes for one in found.things))
            lines += table([found.row(one) for one in found.things], found.header)
            what = "removed" if yes else "would go; do it with --yes"
            lines.append(f"{found.words.format(len(found.things))}, {size}, {what}")
    if as_json:
        show_json(content)
    else:
        for line in lines:
            show(line)
    for line in refused:
        tell(f"rig: {line}")
    tell_next("store prune" if yes else "store prune, dry run", as_json=as_json)


@dataclass(frozen=True, slots=True)
class _Found:
    """Things of one kind, and how they are told."""

    things: Sequence[Any]
    header: tuple[str, ...]
    row: Callable[[Any], list[str]]
    as_dict: Callable[[Any], dict[str, object]]
    words: str
    """With their number to be filled in."""


_Pruned = tuple[_Found, Sequence[str]]


def _sweeps(store: "Store", wanted: "PruneRequest", yes: bool) -> _Pruned:
    from rig.store.prune import prunable, prune

    found, refused = prunable(store, wanted), ()
    if yes and found:
        done = prune(store, found)
        found, refused = done.sweeps, done.refused
    header = ("sweep", "rig", "begun", "samples", "size")
    return _Found(found, header, prunable_row, prunable_as_dict, "images of {} sweeps"), refused


def _albums(store: "Store", wanted: "PruneRequest", yes: bool) -> _Pruned:
    from rig.store.prune_albums import prunable_albums, prune_albums

    found, refused = prunable_albums(store, wanted), ()
    if yes and found:
        found, refused = prune_albums(store, found)
    header = ("calibration", "rig", "made", "pictures", "size")
    return _Found(found, header, album_row, album_as_dict, "pictures of {} calibrations"), refused


def _captures(store: "Store", wanted: "PruneRequest", yes: bool) -> _Pruned:
    from rig.store.prune_captures import prunable_captures, prune_captures

    found, refused = prunable_captures(store, wanted), ()
    if yes:
        found, refused = prune_captures(store, found)
    header = ("capture", "rig", "begun", "size")
    return _Found(found, header, capture_row, capture_as_dict, "{} captures"), refused


_PRUNED = {
    KindChoice.SWEEPS: _sweeps,
    KindChoice.ALBUMS: _albums,
    KindChoice.CAPTURES: _captures,
}


def _days_ago(days: float) -> datetime:
    try:
        return datetime.now(UTC) - timedelta(days=days)
    except OverflowError as error:
        raise typer.BadParameter(f"--older-than {days:g}: no sweep is so old") from error
