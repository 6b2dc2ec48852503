"""`rig fit`: slopes and curve again from stored frames."""

from typing import Annotated

import typer

from rig.cli.conclusion import show_result
from rig.cli.options import AsJson, DatabaseUrl

SweepNumber = Annotated[
    int, typer.Argument(metavar="SWEEP", help="Number of the sweep; `rig history` shows them.")
]


def fit(
    sweep_id: SweepNumber,
    *,
    calibration: Annotated[
        str | None,
        typer.Option(
            "--calibration",
            metavar="ID|none",
            help="Measure with this geometric calibration, or with none; default: as before.",
            show_default=False,
        ),
    ] = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Compute slopes and curve of a sweep again from its stored frames; no hardware is touched."""
    from rig.cli.progress import Progress
    from rig.database import open_store
    from rig.report import write_report
    from rig.sweep.measure_again import measure_again

    with open_store(database) as store:
        total = len(store.samples(sweep_id))
        with Progress(total) as progress:
            result = measure_again(store, sweep_id, progress.report, calibration)
        write_report(store, result)
    show_result(result, as_json=as_json)
