"""Parquet tables; needs the extra `parquet`."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import ConfigError
from rig.export.exported import ExportedSamples
from rig.export.samples import COLUMNS, WHO, Cell, sample_rows
from rig.files import write_bytes

if TYPE_CHECKING:
    from rig.database import Store

_NUMBERED = ("sweep", "stop", "sample")
_WORDS = ("role", "direction", "taken_at", "failure", *WHO)


def write_parquet(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """Write the samples of a sweep as Parquet: 64-bit numbers, nothing is a null.

    Raises:
        ConfigError: the extra `parquet` is not installed.
        StoreError: the file cannot be written.
    """
    try:
        # Here, because only those who ask for Parquet have it.
        import pyarrow as pa  # noqa: PLC0415
        import pyarrow.parquet as pq  # noqa: PLC0415
    except ImportError as error:
        raise ConfigError(
            "Parquet asked for, pyarrow is not installed",
            advice="pip install 'epirig[parquet]', or take --format csv",
        ) from error
    schema = pa.schema(
        [
            (
                name,
                pa.int64()
                if name in _NUMBERED
                else pa.string()
                if name in _WORDS
                else pa.float64(),
            )
            for name in COLUMNS
        ]
    )
    sink = io.BytesIO()
    pq.write_table(pa.Table.from_pylist(list(rows), schema=schema), sink)
    write_bytes(path, sink.getvalue())


@dataclass(frozen=True, slots=True)
class ParquetExport:
    """Writes the samples of a sweep as Parquet."""

    def export(self, store: "Store", number: int, out: Path | None) -> ExportedSamples:
        """See `Exporter.export`."""
        path, rows = out or Path(f"sweep_{number}.parquet"), sample_rows(store, number)
        write_parquet(path, rows)
        return ExportedSamples(path, len(rows))
