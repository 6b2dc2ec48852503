"""Looking things up; what is not there is named together with what is."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from rig.database.tables import (
    CalibrationRow,
    CurveRow,
    MeasurementRow,
    SampleRow,
    StopRow,
    SweepRow,
)
from rig.errors import StoreError
from rig.records import HistoryRow, SampleKey, State


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


def has_curve(session: Session, rig: str) -> bool:
    """Return whether a rig has a curve."""
    return (
        session.scalars(select(CurveRow.id).where(CurveRow.rig == rig).limit(1)).first() is not None
    )


def active_curve_row(session: Session, rig: str) -> CurveRow:
    """Return the newest active curve of a rig.

    Raises:
        StoreError: there is none, or only some that missed a quality gate.
    """
    newest = select(CurveRow).where(CurveRow.rig == rig).order_by(CurveRow.id.desc()).limit(1)
    row = session.scalars(newest.where(CurveRow.active.is_(True))).first()
    if row is None:
        missed = session.scalars(newest).first()
        if missed is not None:
            raise StoreError(
                f"asked for the curve of rig {rig}, its newest, {missed.id}, missed a quality gate",
                advice=f"read the report of sweep {missed.sweep_id} and sweep again, or take it on "
                f"purpose with --curve {missed.id}",
            )
        rigs = session.scalars(select(CurveRow.rig).where(CurveRow.active.is_(True)).distinct())
        raise StoreError(
            f"asked for the curve of rig {rig}, found curves of "
            f"{', '.join(sorted(rigs)) or 'no rig'}",
            advice="make one with rig sweep; rig calibrate or rig import gives one without a stage",
        )
    return row


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


def active_calibration_row(session: Session, rig: str) -> CalibrationRow | None:
    """Return the newest active calibration of a rig, None where it has none."""
    of_rig = select(CalibrationRow).where(CalibrationRow.rig == rig)
    active = of_rig.where(CalibrationRow.active.is_(True))
    return session.scalars(active.order_by(CalibrationRow.id.desc()).limit(1)).first()


def history_rows(session: Session, at_work: Mapping[int, str]) -> tuple[HistoryRow, ...]:
    """Return every sweep, oldest first, with how far it came and its newest curve.

    Args:
        session: to read from.
        at_work: by sweep, the program that works on it.
    """
    stops = select(StopRow.sweep_id, func.count()).group_by(StopRow.sweep_id)
    planned = dict(iter(session.execute(stops)))
    taken: dict[int, list[int]] = {}
    for sweep_id, count in session.execute(
        select(SampleRow.sweep_id, func.count()).group_by(SampleRow.sweep_id, SampleRow.stop)
    ):
        taken.setdefault(sweep_id, []).append(count)
    newest = {row.sweep_id: row for row in session.scalars(select(CurveRow).order_by(CurveRow.id))}
    return tuple(
        replace(
            _history_row(row, planned.get(row.id, 0), taken.get(row.id, []), newest.get(row.id)),
            at_work=at_work.get(row.id),
        )
        for row in session.scalars(select(SweepRow).order_by(SweepRow.id))
    )


def _history_row(
    row: SweepRow, planned: int, taken: Sequence[int], newest: CurveRow | None
) -> HistoryRow:
    rms_pct = None if newest is None else newest.holdout.get("rms_pct")
    return HistoryRow(
        id=row.id,
        rig=row.rig,
        started_at=row.started_at,
        ended_at=row.ended_at,
        state=cast("State", row.state),
        stops_done=sum(count >= row.samples_per_stop for count in taken),
        stops_planned=planned,
        samples=sum(taken),
        curve_id=None if newest is None else newest.id,
        holdout_rms_pct=rms_pct if isinstance(rms_pct, float) else None,
        rows_rms_px=None if newest is None else _rows_rms_px(newest),
    )


def _rows_rms_px(row: CurveRow) -> float | None:
    rms_px = {} if row.row_errors is None else row.row_errors.get("rms_px")
    return max(cast("list[float]", rms_px)) if isinstance(rms_px, list) and rms_px else None


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
