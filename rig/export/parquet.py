"""Parquet tables; needs the extra `parquet`, and is imported only where one is asked for."""

import io
from collections.abc import Sequence
from pathlib import Path

from rig.errors import ConfigError
from rig.export.samples import COLUMNS, Cell
from rig.files import write_bytes

try:
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError as error:
    raise ConfigError(
        "Parquet asked for, pyarrow is not installed",
        advice="pip install 'epirig[parquet]', or take --format csv",
    ) from error

_NUMBERED = ("sweep", "stop", "sample")
_WORDS = ("role", "direction", "taken_at", "failure")


def write_parquet(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """Write the samples of a sweep as Parquet: 64-bit numbers, nothing is a null.

    Raises:
        StoreError: the file cannot be written.
    """
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
