"""The part of the store that keeps what was measured in samples."""

from collections.abc import Mapping

from rig.database import queries
from rig.database.convert import measurement_row, measurement_value
from rig.database.leases import LeaseShelf, sweep_lease
from rig.measurement import Measurement
from rig.records import SampleKey


class MeasurementShelf(LeaseShelf):
    """Slopes of stored samples; they can be derived from the frames again at any time."""

    def save_measurements(
        self, sweep_id: int, measurements: Mapping[SampleKey, Measurement]
    ) -> None:
        """Store what was derived from samples; earlier measurements of these give way.

        Raises:
            OwnedError: another program works on the sweep.
            StoreError: one of the samples is not stored; nothing was changed.
        """
        with self._writing(f"store the slopes of sweep {sweep_id}") as session:
            self._require_owned(session, sweep_lease(sweep_id))
            for key, measurement in measurements.items():
                row = measurement_row(measurement)
                row.sample_id = queries.sample_id(session, sweep_id, key)
                session.merge(row)

    def replace_measurements(
        self,
        sweep_id: int,
        measurements: Mapping[SampleKey, Measurement],
        *,
        calibration_id: int | None,
    ) -> None:
        """Store all slopes of a sweep anew, measured with this calibration or with none.

        Raises:
            OwnedError: another program works on the sweep.
            StoreError: no such sweep, sample or calibration; nothing was changed.
        """
        with self._writing(f"store the slopes of sweep {sweep_id}") as session:
            self._require_owned(session, sweep_lease(sweep_id))
            if calibration_id is not None:
                queries.calibration_row(session, calibration_id)
            queries.sweep_row(session, sweep_id).calibration_id = calibration_id
            for row in queries.measurement_rows(session, sweep_id).values():
                session.delete(row)
            session.flush()
            for key, measurement in measurements.items():
                row = measurement_row(measurement)
                row.sample_id = queries.sample_id(session, sweep_id, key)
                session.add(row)

    def measurements(self, sweep_id: int) -> dict[SampleKey, Measurement]:
        """Return what was derived from the samples of a sweep, in the order of its plan.

        Raises:
            StoreError: no such sweep.
        """
        with self._reading(f"read the slopes of sweep {sweep_id}") as session:
            rows = queries.measurement_rows(session, sweep_id)
            return {key: measurement_value(row) for key, row in rows.items()}
