"""`rig fit`: slopes and curve again from stored frames."""

from rig.cli.conclusion import show_result
from rig.cli.options import AsJson, CalibrationAgain, DatabaseUrl, SweepNumber


def fit(
    sweep_id: SweepNumber,
    *,
    calibration: CalibrationAgain = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Compute slopes and curve of a sweep again from its stored frames; no hardware is touched."""
    from rig.cli.progress import ProgressLine
    from rig.database import open_store
    from rig.interrupts import saying
    from rig.report import write_report
    from rig.sweep.measure_again import measure_again

    with (
        open_store(database, absent="refused") as store,
        store.owned_sweep(sweep_id, f"asked to fit sweep {sweep_id}"),
        saying(lambda: f"the samples of sweep {sweep_id} are as they were: rig fit {sweep_id}"),
    ):
        total = len(store.samples(sweep_id))
        with ProgressLine(total) as progress:
            result = measure_again(store, sweep_id, progress.report, calibration)
        write_report(store, result)
    show_result(result, as_json=as_json)
