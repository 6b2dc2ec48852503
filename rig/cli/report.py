"""`rig report`: one self-contained HTML file."""

from rig.cli.options import AsJson, DatabaseUrl, SweepNumber
from rig.cli.output import show, show_json


def report(sweep_id: SweepNumber, *, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """Write the report of a sweep again, from its stored slopes; the curve in use stays."""
    from rig.database import open_store
    from rig.report import write_report
    from rig.sweep.conclude import stored_conclusion

    with open_store(database, absent="refused") as store:
        path = write_report(store, stored_conclusion(store, sweep_id))
    if as_json:
        show_json({"sweep": sweep_id, "report": str(path)})
    else:
        show(str(path))
