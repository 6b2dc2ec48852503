"""`rig store`: the operator's verbs; those that look are here."""

from typing import Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl
from rig.cli.output import show, show_json, table, tell
from rig.cli.store_copies import back_up_store, migrate_store, move_store, restore_store
from rig.cli.store_prune import prune_store
from rig.cli.store_result import (
    DAMAGED,
    MOST_SHOWN,
    inventory_as_dict,
    size_in_words,
    usage_as_dict,
)

app = typer.Typer(
    help="Check, copy, thin out and move all that is stored.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)


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
        for finding in left[:MOST_SHOWN]:
            show(str(finding))
        if len(left) > MOST_SHOWN:
            show(f"and {len(left) - MOST_SHOWN} more; --json lists all")
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
        raise typer.Exit(DAMAGED)
    tell_next("store verify", as_json=as_json)


app.command("backup")(back_up_store)
app.command("restore")(restore_store)
app.command("prune")(prune_store)


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


app.command("move")(move_store)
app.command("migrate")(migrate_store)
