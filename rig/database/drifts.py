"""The part of the store that keeps what scenes told of the cameras, look after look."""

from datetime import UTC, datetime

from sqlalchemy import select

from rig.database.convert import drift_value
from rig.database.tables import DriftRow
from rig.database.transactions import Transactions
from rig.records import Json, StoredDrift


class DriftShelf(Transactions):
    """Looks at scenes; none is ever changed."""

    def save_drift(
        self,
        calibration_id: int,
        *,
        rig: str,
        details: Json,
        temperature_degc: float | None,
        unit: str = "",
    ) -> StoredDrift:
        """Store what one scene told.

        Args:
            calibration_id: the calibration that it was compared with.
            rig: name of the rig.
            details: see `rig.check.scene_drift`.
            temperature_degc: of the camera, None where it reports none.
            unit: which of the rigs of this name; empty where nobody knows.

        Returns:
            The look, as it is stored.
        """
        with self._writing(f"store the drift of {rig}") as session:
            row = DriftRow(
                rig=rig,
                unit=unit,
                calibration_id=calibration_id,
                measured_at=datetime.now(UTC),
                temperature_degc=None if temperature_degc is None else float(temperature_degc),
                details=dict(details),
            )
            session.add(row)
            session.flush()
            return drift_value(row)

    def drifts(self, rig: str | None = None) -> tuple[StoredDrift, ...]:
        """Return the looks of a rig, or of all rigs, oldest first."""
        with self._reading("list the drifts") as session:
            wanted = select(DriftRow).order_by(DriftRow.id)
            if rig is not None:
                wanted = wanted.where(DriftRow.rig == rig)
            return tuple(drift_value(row) for row in session.scalars(wanted))
