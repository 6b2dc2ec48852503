"""The part of the store that keeps geometric calibrations."""

from datetime import UTC, datetime

from rig.database import queries
from rig.database.convert import calibration_value, provenance_json
from rig.database.provenance import this_program
from rig.database.tables import CalibrationRow
from rig.database.transactions import Transactions
from rig.records import Json, Provenance, StoredCalibration


class CalibrationShelf(Transactions):
    """Calibrations of every rig; none is ever changed or replaced, drift shows between them."""

    def save_calibration(
        self,
        *,
        rig: str,
        geometry: Json,
        quality: Json,
        profile: Json,
        versions: Json,
        devices: Json,
        temperature_degc: float | None,
        image_size_px: tuple[int, int],
        active: bool = True,
        unit: str = "",
        note: str = "",
        provenance: Provenance | None = None,
    ) -> int:
        """Store a geometric calibration.

        Args:
            rig: name of the rig.
            geometry: all that it needs to come back: see `rig.geometry.rig_geometry_json`.
            quality: what it is worth: residuals, depth error, verdict.
            profile: the whole profile as JSON data.
            versions: see `software_versions`.
            devices: identity of camera and stage, with serial numbers.
            temperature_degc: of the camera, None where it reports none.
            image_size_px: width and height of the pictures.
            active: whether sweeps and captures take it by themselves.
            unit: which of the rigs of this name; empty where nobody knows.
            note: free text of the user.
            provenance: who made it; None for this program.

        Returns:
            The id of the calibration.
        """
        with self._writing(f"store a calibration of {rig}") as session:
            row = CalibrationRow(
                rig=rig,
                created_at=datetime.now(UTC),
                geometry=dict(geometry),
                quality=dict(quality),
                profile=dict(profile),
                versions=dict(versions),
                devices=dict(devices),
                temperature_degc=None if temperature_degc is None else float(temperature_degc),
                width_px=int(image_size_px[0]),
                height_px=int(image_size_px[1]),
                active=active,
                unit=unit,
                note=note,
                provenance=provenance_json(provenance or this_program()),
            )
            session.add(row)
            session.flush()
            return row.id

    def calibration(self, calibration_id: int) -> StoredCalibration:
        """Return one calibration.

        Raises:
            StoreError: no such calibration; the message names those that there are.
        """
        with self._reading(f"read calibration {calibration_id}") as session:
            return calibration_value(queries.calibration_row(session, calibration_id))

    def active_calibration(self, rig: str, unit: str = "") -> StoredCalibration | None:
        """Return the newest active calibration of a rig, None where it has none.

        Args:
            rig: its name.
            unit: only of this one of the rigs of that name, and of those that nobody named.
        """
        with self._reading(f"look for the calibration of {rig}") as session:
            row = queries.active_calibration_row(session, rig, unit)
            return None if row is None else calibration_value(row)

    def calibrations(self, rig: str | None = None) -> tuple[StoredCalibration, ...]:
        """Return the calibrations of a rig, or of all rigs, oldest first."""
        with self._reading("list the calibrations") as session:
            return tuple(calibration_value(r) for r in queries.calibration_rows(session, rig))
