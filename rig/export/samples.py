"""The samples of a sweep as a table."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.export.exported import ExportedSamples
from rig.files import write_bytes

if TYPE_CHECKING:
    from rig.database import Store

WHO = ("rig", "unit", "user", "host", "command", "note", "tags")
"""The same in every row of a sweep: tables of many sweeps are put together by these."""
COLUMNS: tuple[str, ...] = (
    "sweep", "stop", "sample", "role", "direction", "distance_mm", "reached_mm", "taken_at",
    "temperature_degc", "slope_px", "sigma_px", "corner_slope_px", "corner_sigma_px",
    "dense_slope_px", "dense_sigma_px", "centre_x_px", "centre_y_px", "failure",
    *WHO,
)  # fmt: skip

Cell = str | int | float | None


def sample_rows(store: "Store", sweep_id: int) -> list[dict[str, Cell]]:
    """One row per stored sample, in the order of the sweep; what was not measured is None.

    Raises:
        StoreError: no such sweep.
    """
    measurements = store.measurements(sweep_id)
    sweep = store.sweep(sweep_id)
    made = sweep.provenance
    who = (sweep.rig, sweep.unit, made.user, made.host, made.command, sweep.note)
    rows: list[dict[str, Cell]] = []
    for sample in store.samples(sweep_id):
        found = measurements.get(sample.key)
        centre = None if found is None else found.centre_px
        failure = None if found is None or found.failure is None else found.failure.message
        cells: tuple[Cell, ...] = (
            sweep_id,
            sample.stop.index,
            sample.number,
            sample.stop.role,
            sample.stop.direction,
            sample.stop.distance_mm,
            sample.reached_mm,
            sample.taken_at.isoformat(),
            sample.temperature_degc,
            found and found.slope_px,
            found and found.sigma_px,
            found and found.corner_slope_px,
            found and found.corner_sigma_px,
            found and found.dense_slope_px,
            found and found.dense_sigma_px,
            None if centre is None else centre[0],
            None if centre is None else centre[1],
            failure,
            *who,
            " ".join(made.tags),
        )
        rows.append(dict(zip(COLUMNS, cells, strict=True)))
    return rows


def write_csv(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """Write a table; numbers come back to the last digit, nothing is an empty field.

    Raises:
        StoreError: the file cannot be written.
    """
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
    write_bytes(path, text.getvalue().encode())


@dataclass(frozen=True, slots=True)
class CsvExport:
    """Writes the samples of a sweep as CSV."""

    def export(self, store: "Store", number: int, out: Path | None) -> ExportedSamples:
        """See `Exporter.export`."""
        path, rows = out or Path(f"sweep_{number}.csv"), sample_rows(store, number)
        write_csv(path, rows)
        return ExportedSamples(path, len(rows))
