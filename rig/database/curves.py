"""The part of the store that keeps depth-slope curves."""

from datetime import UTC, datetime

from rig.database import queries
from rig.database.convert import curve_value, provenance_json
from rig.database.leases import LeaseShelf, sweep_lease
from rig.database.provenance import this_program
from rig.database.tables import CurveRow
from rig.records import Json, Provenance, StoredCurve


class CurveShelf(LeaseShelf):
    """Curves of every rig; none is ever changed or replaced."""

    def save_curve(
        self,
        sweep_id: int,
        *,
        curve: Json,
        holdout: Json,
        versions: Json,
        active: bool = True,
        row_errors: Json | None = None,
        provenance: Provenance | None = None,
    ) -> int:
        """Store a curve of the rig of a sweep, measured with the calibration of the sweep.

        With the curve, in one transaction, a sweep that has all its samples is concluded.

        Args:
            sweep_id: where it comes from.
            curve: all that the curve needs to come back.
            holdout: its error at the held-out distances; `rig history` shows `rms_pct`.
            versions: see `software_versions`.
            active: whether captures may pick it.
            row_errors: what the rows missed by; None where nobody knows.
            provenance: who made it; None for this program.

        Returns:
            The id of the curve.

        Raises:
            OwnedError: another program works on the sweep.
            StoreError: no such sweep.
        """
        with self._writing(f"store a curve of sweep {sweep_id}") as session:
            self._require_owned(session, sweep_lease(sweep_id))
            sweep = queries.sweep_row(session, sweep_id)
            row = CurveRow(
                rig=sweep.rig,
                sweep_id=sweep_id,
                created_at=datetime.now(UTC),
                curve=dict(curve),
                holdout=dict(holdout),
                versions=dict(versions),
                active=active,
                calibration_id=sweep.calibration_id,
                row_errors=None if row_errors is None else dict(row_errors),
                unit=sweep.unit,
                provenance=provenance_json(provenance or this_program()),
            )
            session.add(row)
            if queries.is_whole(session, sweep):
                sweep.state = "concluded"
            session.flush()
            return row.id

    def curve(self, curve_id: int) -> StoredCurve:
        """Return one curve.

        Raises:
            StoreError: no such curve; the message names those that there are.
        """
        with self._reading(f"read curve {curve_id}") as session:
            return curve_value(queries.curve_row(session, curve_id))

    def has_curve(self, rig: str, unit: str = "") -> bool:
        """Return whether a rig has a curve at all, also one that missed a gate.

        Args:
            rig: its name.
            unit: only of this one of the rigs of that name, and of those that nobody named.
        """
        with self._reading(f"look for the curve of {rig}") as session:
            return queries.has_curve(session, rig, unit)

    def active_curve(self, rig: str, unit: str = "") -> StoredCurve:
        """Return the newest active curve of a rig.

        Args:
            rig: its name.
            unit: only of this one of the rigs of that name, and of those that nobody named.

        Raises:
            StoreError: there is none; the message names the rigs, or units, that have one.
        """
        with self._reading(f"look for the curve of {rig}") as session:
            return curve_value(queries.active_curve_row(session, rig, unit))
