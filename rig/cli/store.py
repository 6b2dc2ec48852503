"""`rig store`: the operator's verbs."""

import os
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl, finite
from rig.cli.output import show, show_json, table, tell
from rig.cli.store_result import (
    inventory_as_dict,
    manifest_as_dict,
    prunable_as_dict,
    prunable_row,
    size_in_words,
    usage_as_dict,
)

app = typer.Typer(
    help="Check, copy, thin out and move all that is stored.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_SECONDS_OF_DAY = 86400.0
_MOST_SHOWN = 50
_DAMAGED = 3


class VerdictChoice(StrEnum):
    """How a sweep ended."""

    PASSED = "passed"
    MISSED = "missed"
    FAILED = "failed"


@app.command("verify")
def verify_store(
    *,
    repair: Annotated[
        bool,
        typer.Option(
            "--repair",
            help="Put in order what is safe: half-written files and leases of killed programs go, "
            "whole pictures that no row knows are put aside.",
        ),
    ] = False,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Look at every row, every file and every hash; find damage, and what belongs to nothing.

    Sweeps may go on meanwhile. Exit code 3 says that something is damaged or lost.
    """
    from rig.cli.progress import ProgressLine
    from rig.database import open_store
    from rig.store.repair import repair as put_in_order
    from rig.store.verify import verify

    with open_store(database, absent="refused") as store, ProgressLine(None) as progress:
        found = verify(store, progress.report)
        done = put_in_order(store, found.findings) if repair else None
        where = store.database
    if as_json:
        show_json({"database": where, **inventory_as_dict(found, done)})
    else:
        mended = () if done is None else done.done
        left = [finding for finding in found.findings if finding not in mended]
        show(where)
        show(
            f"{found.sweeps} sweeps, {found.samples} samples, {found.albums} albums; "
            f"{found.files} images read, {found.pruned} samples pruned"
        )
        for finding in left[:_MOST_SHOWN]:
            show(str(finding))
        if len(left) > _MOST_SHOWN:
            show(f"and {len(left) - _MOST_SHOWN} more; --json lists all")
        if done is not None:
            aside = "" if done.aside is None else f"; whole pictures are in {done.aside}"
            show(f"{len(done.done)} put in order{aside}")
            for line in done.refused:
                tell(f"rig: {line}")
        elif found.litter:
            show(f"{len(found.litter)} to put in order with: rig store verify --repair")
    if found.damage:
        count = len(found.damage)
        tell(f"rig: {count} damaged or lost; bring them back from a backup (rig store restore)")
        tell_next("store verify, damage", as_json=as_json)
        raise typer.Exit(_DAMAGED)
    tell_next("store verify", as_json=as_json)


@app.command("backup")
def back_up_store(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="New or empty, or an older backup of it.")
    ],
    *,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Copy the whole store into a folder, while sweeps go on; every image is compared.

    Into a folder with an older backup only what is new is copied. Exit code 3 says that something
    was damaged or missing in the store itself.
    """
    from rig.cli.progress import ProgressLine
    from rig.database import open_store
    from rig.interrupts import saying
    from rig.store.backup import back_up

    with (
        saying(lambda: f"the backup in {folder} is unfinished; the same command goes on with it"),
        open_store(database, absent="refused") as store,
        ProgressLine(None) as progress,
    ):
        made = back_up(store, folder, progress.report)
    _show_copied("backup", manifest_as_dict(made, folder), list(made.bad), as_json=as_json)
    tell_next("store backup", as_json=as_json)


@app.command("restore")
def restore_store(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Of rig store backup.")],
    *,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Bring a backup back, into a place where neither database nor frames are.

    The database comes last: until it is there the same command goes on.
    """
    from rig.cli.progress import ProgressLine
    from rig.database.location import locate
    from rig.interrupts import saying
    from rig.store.restore import restore

    location = locate(database, os.environ)
    with (
        saying(lambda: f"{location} is not there yet; the same command goes on"),
        ProgressLine(None) as progress,
    ):
        done = restore(folder, location, progress.report)
    content = manifest_as_dict(done.manifest, folder)
    content |= {"database": done.database, "frames": str(done.frames), "files": done.copied.files}
    _show_copied("restored", content, done.copied.bad, as_json=as_json)
    tell_next("store restore", as_json=as_json)


@app.command("prune")
def prune_store(
    *,
    older_than_days: Annotated[
        float | None,
        typer.Option(
            "--older-than",
            metavar="DAYS",
            min=0.0,
            help="Only sweeps that ended so long ago.",
            callback=finite,
            show_default=False,
        ),
    ] = None,
    rig: Annotated[
        str | None, typer.Option("--rig", metavar="NAME", help="Only of this rig.")
    ] = None,
    verdict: Annotated[
        VerdictChoice | None, typer.Option("--verdict", help="Only sweeps that ended so.")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do it; without, it is only told.")] = False,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Remove the images of old sweeps; their slopes and curves stay.

    Never of sweeps that are not concluded yet or that a program works on. What was pruned is told
    by history, verify and fit, and is no damage. Without --yes nothing is removed.
    """
    from rig.database import open_store
    from rig.store.prune import PruneRequest, prunable, prune

    if older_than_days is None and rig is None and verdict is None:
        raise typer.BadParameter("say whose images: --older-than, --rig, --verdict")
    before = None
    if older_than_days is not None:
        before = _days_ago(older_than_days)
    wanted = PruneRequest(before, rig, None if verdict is None else cast("Any", verdict.value))
    with open_store(database, absent="refused") as store:
        found = prunable(store, wanted)
        done = prune(store, found) if yes and found else None
    sweeps = found if done is None else done.sweeps
    if as_json:
        content = [prunable_as_dict(sweep) for sweep in sweeps]
        show_json({"pruned": done is not None, "sweeps": content})
    else:
        for line in table(
            [prunable_row(s) for s in sweeps], ("sweep", "rig", "begun", "samples", "size")
        ):
            show(line)
        size = size_in_words(sum(sweep.bytes for sweep in sweeps))
        what = "removed" if done is not None else "would go; do it with --yes"
        show(f"images of {len(sweeps)} sweeps, {size}, {what}")
    for line in () if done is None else done.refused:
        tell(f"rig: {line}")
    tell_next("store prune" if done is not None else "store prune, dry run", as_json=as_json)


@app.command("du")
def weigh_store(*, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """Tell what takes how much room."""
    from rig.database import open_store
    from rig.store.usage import usage

    with open_store(database, absent="refused") as store:
        found, where = usage(store), store.database
    if as_json:
        show_json({"database": where, **usage_as_dict(found)})
        return
    show(where)
    rows = [
        [
            rig.rig,
            str(rig.sweeps),
            size_in_words(rig.sweeps_bytes),
            str(rig.albums),
            size_in_words(rig.albums_bytes),
            size_in_words(rig.other_bytes),
        ]
        for rig in found.rigs
    ]
    header = ("rig", "sweeps", "images", "albums", "their images", "other files")
    for line in table(rows, header):
        show(line)
    if found.database_bytes is not None:
        show(f"database {size_in_words(found.database_bytes)}")
    for name, size in found.beside_bytes.items():
        show(f"{name} {size_in_words(size)}")
    if found.orphans_bytes:
        show(f"put aside by verify --repair {size_in_words(found.orphans_bytes)}")
    show(f"together {size_in_words(found.total_bytes)}")
    tell_next("store du", as_json=as_json)


@app.command("move")
def move_store(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="New or empty.")],
    *,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Move database and frames into a folder; nothing is removed before all of it is there.

    Of a server's store only the frames move. No program may be at work on any of it.
    """
    from rig.cli.progress import ProgressLine
    from rig.database import open_store
    from rig.interrupts import saying
    from rig.store.move import move

    with (
        saying(lambda: "the store is where it was, or whole in the new place; see rig history"),
        open_store(database, absent="refused") as store,
        ProgressLine(None) as progress,
    ):
        done = move(store, folder, progress.report)
    if as_json:
        show_json(
            {
                "database": done.database,
                "frames": str(done.frames),
                "files": done.copied.files,
                "bad": done.copied.bad,
                "left": [str(path) for path in done.left],
            }
        )
        return
    show(f"database {done.database}, frames {done.frames}: give --db, or set RIG_DATABASE")
    if os.environ.get("RIG_FRAMES") or not done.database.startswith("sqlite"):
        show(f"and set RIG_FRAMES={done.frames}")
    for path in done.left[:_MOST_SHOWN]:
        tell(f"rig: {path} was left where it is: no row knows it")
    tell_next("store move", as_json=as_json)


@app.command("migrate")
def migrate_store(
    target: Annotated[
        str, typer.Argument(metavar="URL", help="Of the new database; empty, or not there yet.")
    ],
    *,
    copy_frames: Annotated[
        bool,
        typer.Option("--copy-frames", help="Also copy the frames to where the new one has them."),
    ] = False,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Copy all rows into another database, as from SQLite to PostgreSQL or back: all or none.

    They are read back and compared before they count. The old database is left as it is.
    """
    from rig.cli.progress import ProgressLine
    from rig.database import open_store
    from rig.database.location import locate
    from rig.interrupts import saying
    from rig.store.migrate import migrate

    with (
        saying(lambda: "the new database is as empty as before; the same command begins anew"),
        open_store(database, absent="refused") as store,
        ProgressLine(None) as progress,
    ):
        location = locate(target, os.environ)
        done = migrate(store, location, progress.report, copies_frames=copy_frames)
    if as_json:
        show_json(
            {
                "from": done.source,
                "database": done.target,
                "frames": str(done.frames),
                "rows": done.rows,
                "bad": [] if done.copied is None else done.copied.bad,
            }
        )
        return
    count = sum(done.rows.values())
    show(f"{count} rows are in {done.target}, compared; frames in {done.frames}")
    show(f"{done.source} is as it was: remove it once nobody uses it any more")
    tell_next("store migrate", as_json=as_json)


def _days_ago(days: float) -> datetime:
    try:
        return datetime.now(UTC) - timedelta(days=days)
    except OverflowError as error:
        raise typer.BadParameter(f"--older-than {days:g}: no sweep is so old") from error


def _show_copied(word: str, content: dict[str, object], bad: list[str], *, as_json: bool) -> None:
    if as_json:
        show_json({**content, "bad": bad})
    else:
        show(
            f"{word}: {content['sweeps']} sweeps, {content['samples']} samples, "
            f"{content['files']} images, compared; {content['folder']}"
        )
    for line in bad[:_MOST_SHOWN]:
        tell(f"rig: {line}")
    if bad:
        tell(f"rig: {len(bad)} images were damaged or missing where they come from")
        raise typer.Exit(_DAMAGED)
