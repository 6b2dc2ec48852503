"""Looking things up; what is not there is named together with what is."""

from collections.abc import Sequence

from sqlalchemy import ColumnElement, func, select, true
from sqlalchemy.orm import InstrumentedAttribute, Session

from rig.database.tables import (
    CalibrationRow,
    CurveRow,
    MeasurementRow,
    SampleRow,
    StopRow,
    SweepRow,
)
from rig.errors import StoreError
from rig.records import SampleKey


def sweep_row(session: Session, sweep_id: int) -> SweepRow:
    """Return one sweep.

    Raises:
        StoreError: no such sweep.
    """
    row = session.get(SweepRow, sweep_id)
    if row is None:
        ids = session.scalars(select(SweepRow.id).order_by(SweepRow.id)).all()
        raise _not_there("sweep", sweep_id, ids)
    return row


def newest_unfinished_sweep_row(session: Session, rig: str) -> SweepRow:
    """Return the newest sweep of a rig.

    Raises:
        StoreError: there is none, or it is concluded.
    """
    of_rig = select(SweepRow).where(SweepRow.rig == rig)
    row = session.scalars(of_rig.order_by(SweepRow.id.desc()).limit(1)).first()
    if row is None or row.state == "concluded":
        found = "there is none" if row is None else f"the newest, {row.id}, is concluded"
        raise StoreError(
            f"asked to resume a sweep of rig {rig}, {found}",
            advice="begin a new one without --resume",
        )
    return row


def stop_row(session: Session, sweep_id: int, stop: int) -> StopRow:
    """Return one planned stop.

    Raises:
        StoreError: no such sweep, or no such stop in its plan.
    """
    row = session.get(StopRow, (sweep_id, stop))
    if row is None:
        count = len(sweep_row(session, sweep_id).stops)
        raise StoreError(
            f"asked for stop {stop} of sweep {sweep_id}, its plan has {count} stops, from 0",
            advice="begin a new sweep for another plan",
        )
    return row


def sample_rows(session: Session, sweep_id: int) -> Sequence[SampleRow]:
    """Return the samples of a sweep in the order of its plan.

    Raises:
        StoreError: no such sweep.
    """
    sweep_row(session, sweep_id)
    of_sweep = select(SampleRow).where(SampleRow.sweep_id == sweep_id)
    return session.scalars(of_sweep.order_by(SampleRow.stop, SampleRow.sample)).all()


def sweep_ids(session: Session) -> Sequence[int]:
    """Return the numbers of all sweeps, oldest first."""
    return session.scalars(select(SweepRow.id).order_by(SweepRow.id)).all()


def is_whole(session: Session, sweep: SweepRow) -> bool:
    """Tell whether every planned sample of a sweep is stored."""
    planned = SampleRow.sample < sweep.samples_per_stop
    of_sweep = select(func.count()).select_from(SampleRow).where(SampleRow.sweep_id == sweep.id)
    stored = session.scalars(of_sweep.where(planned)).one()
    return stored >= sweep.samples_per_stop * len(sweep.stops)


def has_sample(session: Session, sweep_id: int, key: SampleKey) -> bool:
    """Tell whether a sample is stored."""
    return _sample_id(session, sweep_id, key) is not None


def sample_id(session: Session, sweep_id: int, key: SampleKey) -> int:
    """Return the number of the row of a sample.

    Raises:
        StoreError: it is not stored.
    """
    found = _sample_id(session, sweep_id, key)
    if found is None:
        stop, number = key
        raise StoreError(
            f"asked for sample {number} of stop {stop} of sweep {sweep_id}, it is not stored",
            advice="rig history lists the sweeps",
        )
    return found


def measurement_rows(session: Session, sweep_id: int) -> dict[SampleKey, MeasurementRow]:
    """Return the measurements of a sweep in the order of its plan.

    Raises:
        StoreError: no such sweep.
    """
    sweep_row(session, sweep_id)
    of_sweep = (
        select(SampleRow.stop, SampleRow.sample, MeasurementRow)
        .join(MeasurementRow, MeasurementRow.sample_id == SampleRow.id)
        .where(SampleRow.sweep_id == sweep_id)
        .order_by(SampleRow.stop, SampleRow.sample)
    )
    return {(stop, number): row for stop, number, row in session.execute(of_sweep)}


def curve_row(session: Session, curve_id: int) -> CurveRow:
    """Return one curve.

    Raises:
        StoreError: no such curve.
    """
    row = session.get(CurveRow, curve_id)
    if row is None:
        ids = session.scalars(select(CurveRow.id).order_by(CurveRow.id)).all()
        raise _not_there("curve", curve_id, ids)
    return row


def has_curve(session: Session, rig: str, unit: str = "") -> bool:
    """Return whether a rig has a curve; with a unit, one of that or of no named unit."""
    of_rig = select(CurveRow.id).where(CurveRow.rig == rig, _of_unit(CurveRow.unit, unit))
    return session.scalars(of_rig.limit(1)).first() is not None


def _of_unit(column: InstrumentedAttribute[str], unit: str) -> ColumnElement[bool]:
    return column.in_((unit, "")) if unit else true()


def active_curve_row(session: Session, rig: str, unit: str = "") -> CurveRow:
    """Return the newest active curve of a rig; with a unit, one of that or of no named unit.

    Raises:
        StoreError: there is none, or only some that missed a quality gate, or of other units.
    """
    of_rig = select(CurveRow).where(CurveRow.rig == rig, _of_unit(CurveRow.unit, unit))
    newest = of_rig.order_by(CurveRow.id.desc()).limit(1)
    row = session.scalars(newest.where(CurveRow.active.is_(True))).first()
    if row is None:
        missed = session.scalars(newest).first()
        if missed is not None:
            raise StoreError(
                f"asked for the curve of rig {rig}, its newest, {missed.id}, missed a quality gate",
                advice=f"read the report of sweep {missed.sweep_id} and sweep again, or take it on "
                f"purpose with --curve {missed.id}",
            )
        _require_no_other_unit(session, rig, unit)
        rigs = session.scalars(select(CurveRow.rig).where(CurveRow.active.is_(True)).distinct())
        raise StoreError(
            f"asked for the curve of rig {rig}, found curves of "
            f"{', '.join(sorted(rigs)) or 'no rig'}",
            advice="make one with rig sweep; rig calibrate or rig import gives one without a stage",
        )
    return row


def _require_no_other_unit(session: Session, rig: str, unit: str) -> None:
    of_rig = select(CurveRow).where(CurveRow.rig == rig, CurveRow.active.is_(True))
    other = session.scalars(of_rig.order_by(CurveRow.id.desc()).limit(1)).first()
    if unit and other is not None:
        raise StoreError(
            f"asked for the curve of unit {unit} of rig {rig}, the newest, {other.id}, is of unit "
            f"{other.unit}",
            advice=f"make one with rig sweep, or take that one on purpose with --curve {other.id}",
        )


def calibration_row(session: Session, calibration_id: int) -> CalibrationRow:
    """Return one calibration.

    Raises:
        StoreError: no such calibration.
    """
    row = session.get(CalibrationRow, calibration_id)
    if row is None:
        ids = session.scalars(select(CalibrationRow.id).order_by(CalibrationRow.id)).all()
        found = ", ".join(str(id_) for id_ in ids[-10:]) or "none yet"
        raise StoreError(
            f"asked for calibration {calibration_id}, found {found}",
            advice="rig calibrate makes one",
        )
    return row


def calibration_rows(session: Session, rig: str | None) -> Sequence[CalibrationRow]:
    """Return the calibrations of a rig, or of all, oldest first."""
    wanted = select(CalibrationRow).order_by(CalibrationRow.id)
    if rig is not None:
        wanted = wanted.where(CalibrationRow.rig == rig)
    return session.scalars(wanted).all()


def active_calibration_row(session: Session, rig: str, unit: str = "") -> CalibrationRow | None:
    """Return the newest active calibration of a rig, None where it has none; see `has_curve`."""
    mine = _of_unit(CalibrationRow.unit, unit)
    of_rig = select(CalibrationRow).where(CalibrationRow.rig == rig, mine)
    active = of_rig.where(CalibrationRow.active.is_(True))
    return session.scalars(active.order_by(CalibrationRow.id.desc()).limit(1)).first()


def newest_curve_id(session: Session, sweep_id: int) -> int | None:
    """Return the number of the newest curve of a sweep, None where it has none."""
    of_sweep = select(CurveRow.id).where(CurveRow.sweep_id == sweep_id)
    return session.scalars(of_sweep.order_by(CurveRow.id.desc()).limit(1)).first()


def pruned_count(session: Session, sweep_id: int) -> int:
    """Return how many samples of a sweep have no frames any more, on purpose."""
    pruned = (SampleRow.sweep_id == sweep_id, SampleRow.pruned_at.is_not(None))
    return session.scalars(select(func.count()).select_from(SampleRow).where(*pruned)).one()


def _sample_id(session: Session, sweep_id: int, key: SampleKey) -> int | None:
    stop, number = key
    return session.scalars(
        select(SampleRow.id).where(
            SampleRow.sweep_id == sweep_id, SampleRow.stop == stop, SampleRow.sample == number
        )
    ).first()


def _not_there(kind: str, wanted: int, ids: Sequence[int]) -> StoreError:
    if not ids:
        return StoreError(
            f"asked for {kind} {wanted}, there is none yet", advice="rig sweep makes one"
        )
    newest = ", ".join(str(id_) for id_ in ids[-10:])
    return StoreError(f"asked for {kind} {wanted}, found {newest}", advice="rig history lists them")
