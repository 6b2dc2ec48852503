"""An export with its effect on the store: opened once, read, closed."""

from pathlib import Path

from rig.database import open_store
from rig.export.exported import Exported
from rig.export.formats import Exporter


def export_stored(
    exporter: Exporter, number: int, out: Path | None, database: str | None
) -> Exported:
    """Write what a number of a database stands for.

    Args:
        exporter: of a format, with its options.
        number: of a calibration, or of a sweep.
        out: file or folder; None makes a name.
        database: URL; None for the user's own.

    Raises:
        FormatError: the format cannot hold it.
        StoreError: it is not there, or cannot be written.
    """
    with open_store(database, absent="refused") as store:
        return exporter.export(store, number, out)
