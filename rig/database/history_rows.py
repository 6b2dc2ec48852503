"""Rows of `rig history`: sweeps with how far they came, counted over all tables at once."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import cast

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from rig.database.convert import provenance_value
from rig.database.tables import CurveRow, SampleRow, StopRow, SweepRow
from rig.records import HistoryRow, State


def history_rows(
    session: Session,
    at_work: Mapping[int, str],
    sweeps: Collection[int] | None = None,
    curves: Collection[int] | None = None,
) -> tuple[HistoryRow, ...]:
    """Return sweeps, oldest first, with how far they came and their newest curve.

    Args:
        session: to read from.
        at_work: by sweep, the program that works on it.
        sweeps: only these; None for all.
        curves: only these count; None for all.
    """
    stops = select(StopRow.sweep_id, func.count()).group_by(StopRow.sweep_id)
    planned = dict(iter(session.execute(stops)))
    taken: dict[int, list[int]] = {}
    for sweep_id, count in session.execute(
        select(SampleRow.sweep_id, func.count()).group_by(SampleRow.sweep_id, SampleRow.stop)
    ):
        taken.setdefault(sweep_id, []).append(count)
    is_pruned = SampleRow.pruned_at.is_not(None)
    given_up = select(SampleRow.sweep_id, func.count()).where(is_pruned)
    pruned = dict(iter(session.execute(given_up.group_by(SampleRow.sweep_id))))
    shown, known = select(SweepRow).order_by(SweepRow.id), select(CurveRow).order_by(CurveRow.id)
    if sweeps is not None:
        shown = shown.where(SweepRow.id.in_(sweeps))
    if curves is not None:
        known = known.where(CurveRow.id.in_(curves))
    newest = {row.sweep_id: row for row in session.scalars(known)}
    return tuple(
        replace(
            _history_row(row, planned.get(row.id, 0), taken.get(row.id, []), newest.get(row.id)),
            at_work=at_work.get(row.id),
            pruned=pruned.get(row.id, 0),
        )
        for row in session.scalars(shown)
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
        unit=row.unit,
        note=row.note,
        provenance=provenance_value(row.provenance),
        devices=row.devices,
        versions=row.versions,
        is_active=newest is not None and newest.active,
    )


def _rows_rms_px(row: CurveRow) -> float | None:
    rms_px = {} if row.row_errors is None else row.row_errors.get("rms_px")
    return max(cast("list[float]", rms_px)) if isinstance(rms_px, list) and rms_px else None
