"""`rig report`: one self-contained HTML file."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl, SweepNumber
from rig.cli.output import show, show_json


def report(
    sweep_id: SweepNumber,
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FILE.html",
            help="Write it there; default: beside the frames of the sweep.",
            show_default=False,
        ),
    ] = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Write the report of a sweep again, from its stored slopes; the curve in use stays."""
    from rig.database import open_store
    from rig.report import write_report
    from rig.sweep.conclude import stored_conclusion

    with open_store(database, absent="refused") as store:
        result = stored_conclusion(store, sweep_id)
        path = write_report(store, result if out is None else replace(result, report=out))
    if as_json:
        show_json({"sweep": sweep_id, "report": str(path)})
    else:
        show(str(path))
    tell_next("report", as_json=as_json)
