"""`rig store backup`, `restore`, `move`, `migrate`: all that is stored, in another place too."""

import os
from pathlib import Path
from typing import Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl
from rig.cli.output import show, show_json, tell
from rig.cli.store_result import DAMAGED, MOST_SHOWN, manifest_as_dict


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
    for path in done.left[:MOST_SHOWN]:
        tell(f"rig: {path} was left where it is: no row knows it")
    tell_next("store move", as_json=as_json)


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


def _show_copied(word: str, content: dict[str, object], bad: list[str], *, as_json: bool) -> None:
    if as_json:
        show_json({**content, "bad": bad})
    else:
        show(
            f"{word}: {content['sweeps']} sweeps, {content['samples']} samples, "
            f"{content['files']} images, compared; {content['folder']}"
        )
    for line in bad[:MOST_SHOWN]:
        tell(f"rig: {line}")
    if bad:
        tell(f"rig: {len(bad)} images were damaged or missing where they come from")
        raise typer.Exit(DAMAGED)
