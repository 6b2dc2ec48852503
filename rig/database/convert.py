"""Between rows and values."""

from dataclasses import asdict
from pathlib import Path, PurePosixPath
from typing import cast

from rig.database.details import details_json, read_details
from rig.database.tables import (
    CalibrationRow,
    CurveRow,
    DriftRow,
    FrameRow,
    MeasurementRow,
    SampleRow,
    StopRow,
    SweepRow,
)
from rig.errors import StoreError
from rig.measurement import Failure, Measurement
from rig.plan import Direction, Role, Stop
from rig.records import (
    Json,
    Provenance,
    Sample,
    State,
    StoredCalibration,
    StoredCurve,
    StoredDrift,
    StoredFrame,
    Sweep,
)


def stop_row(stop: Stop) -> StopRow:
    """Return the row of a planned stop."""
    return StopRow(
        stop=stop.index,
        distance_mm=float(stop.distance_mm),
        role=stop.role,
        direction=stop.direction,
    )


def stop_value(row: StopRow) -> Stop:
    """Return a planned stop."""
    role, direction = cast("Role", row.role), cast("Direction", row.direction)
    return Stop(row.stop, row.distance_mm, role, direction)


def sweep_value(row: SweepRow, frames: Path) -> Sweep:
    """Return a sweep; `frames` is the root of all frame folders."""
    return Sweep(
        id=row.id,
        rig=row.rig,
        profile=row.profile,
        versions=row.versions,
        devices=row.devices,
        stops=tuple(stop_value(stop) for stop in row.stops),
        samples_per_stop=row.samples_per_stop,
        started_at=row.started_at,
        ended_at=row.ended_at,
        state=cast("State", row.state),
        folder=below(frames, row.folder),
        note=row.note,
        calibration_id=row.calibration_id,
        unit=row.unit,
        provenance=provenance_value(row.provenance),
    )


def frame_row(place: int, frame: StoredFrame) -> FrameRow:
    """Return the row of one image."""
    return FrameRow(
        place=place,
        view=frame.view,
        timestamp_s=float(frame.timestamp_s),
        sequence=int(frame.sequence),
        exposure_s=_maybe(frame.exposure_s),
        bits=frame.bits,
        uncertainty_s=float(frame.uncertainty_s),
        sha256=frame.sha256,
    )


def sample_value(row: SampleRow, frames: Path) -> Sample:
    """Return a sample; `frames` is the root of all frame folders."""
    return Sample(
        sweep_id=row.sweep_id,
        stop=stop_value(row.planned),
        number=row.sample,
        reached_mm=row.reached_mm,
        taken_at=row.taken_at,
        temperature_degc=row.temperature_degc,
        folder=below(frames, row.folder),
        pruned_at=row.pruned_at,
        frames=tuple(
            StoredFrame(
                view=f.view,
                timestamp_s=f.timestamp_s,
                sequence=f.sequence,
                exposure_s=f.exposure_s,
                sha256=f.sha256,
                bits=f.bits,
                uncertainty_s=f.uncertainty_s,
            )
            for f in row.frames
        ),
    )


def measurement_row(measurement: Measurement) -> MeasurementRow:
    """Return the row of a measurement."""
    plane = measurement.plane or (None, None, None)
    centre = measurement.centre_px or (None, None)
    failure = measurement.failure
    return MeasurementRow(
        slope_px=_maybe(measurement.slope_px),
        sigma_px=_maybe(measurement.sigma_px),
        plane_a_px=_maybe(plane[0]),
        plane_b=_maybe(plane[1]),
        plane_c=_maybe(plane[2]),
        centre_x_px=_maybe(centre[0]),
        centre_y_px=_maybe(centre[1]),
        corner_slope_px=_maybe(measurement.corner_slope_px),
        corner_sigma_px=_maybe(measurement.corner_sigma_px),
        dense_slope_px=_maybe(measurement.dense_slope_px),
        dense_sigma_px=_maybe(measurement.dense_sigma_px),
        failure_reason=failure.reason if failure else None,
        failure_message=failure.message if failure else None,
        details=details_json(measurement),
    )


def measurement_value(row: MeasurementRow) -> Measurement:
    """Return a measurement.

    Raises:
        StoreError: its row holds what no measurement does.
    """
    try:
        return _measurement_value(row)
    except ValueError as error:
        raise StoreError(
            f"the database is damaged: the measurement of row {row.sample_id}: {error}",
            advice="run rig fit on its sweep",
        ) from error


def _measurement_value(row: MeasurementRow) -> Measurement:
    plane = None
    if row.plane_a_px is not None and row.plane_b is not None and row.plane_c is not None:
        plane = (row.plane_a_px, row.plane_b, row.plane_c)
    centre_px = None
    if row.centre_x_px is not None and row.centre_y_px is not None:
        centre_px = (row.centre_x_px, row.centre_y_px)
    failure = None
    if row.failure_reason is not None and row.failure_message is not None:
        failure = Failure(row.failure_reason, row.failure_message)
    details = read_details(row.details)
    return Measurement(
        slope_px=row.slope_px,
        sigma_px=row.sigma_px,
        plane=plane,
        plane_sigma=details.plane_sigma,
        centre_px=centre_px,
        corner_slope_px=row.corner_slope_px,
        corner_sigma_px=row.corner_sigma_px,
        dense_slope_px=row.dense_slope_px,
        dense_sigma_px=row.dense_sigma_px,
        corners_px=details.corners_px or None,
        outline_px=details.outline_px or None,
        epipolar=details.epipolar,
        track_residual_px=details.track_residual_px,
        residual_levels=details.residual_levels,
        edge_pixels=details.edge_pixels,
        views=details.views,
        across_px=details.across_px,
        size_px=details.size_px,
        dense_pixel_sigma_px=details.dense_pixel_sigma_px,
        failure=failure,
    )


def curve_value(row: CurveRow) -> StoredCurve:
    """Return a curve."""
    return StoredCurve(
        id=row.id,
        rig=row.rig,
        sweep_id=row.sweep_id,
        created_at=row.created_at,
        curve=row.curve,
        holdout=row.holdout,
        versions=row.versions,
        active=row.active,
        calibration_id=row.calibration_id,
        row_errors=row.row_errors,
        unit=row.unit,
        provenance=provenance_value(row.provenance),
    )


def calibration_value(row: CalibrationRow) -> StoredCalibration:
    """Return a calibration."""
    return StoredCalibration(
        id=row.id,
        rig=row.rig,
        created_at=row.created_at,
        geometry=row.geometry,
        quality=row.quality,
        profile=row.profile,
        versions=row.versions,
        devices=row.devices,
        temperature_degc=row.temperature_degc,
        image_size_px=(row.width_px, row.height_px),
        active=row.active,
        unit=row.unit,
        note=row.note,
        provenance=provenance_value(row.provenance),
    )


def drift_value(row: DriftRow) -> StoredDrift:
    """Return what a scene told."""
    return StoredDrift(
        id=row.id,
        rig=row.rig,
        calibration_id=row.calibration_id,
        measured_at=row.measured_at,
        temperature_degc=row.temperature_degc,
        details=row.details,
        unit=row.unit,
    )


def provenance_value(column: Json) -> Provenance:
    """Return who made something; what another version wrote is left out."""
    words = {name: str(column.get(name, "")) for name in ("user", "host", "command")}
    tags = column.get("tags", ())
    named = cast("list[object]", tags) if isinstance(tags, list) else ()
    return Provenance(**words, tags=tuple(map(str, named)))


def provenance_json(provenance: Provenance) -> dict[str, object]:
    """Return the column that `provenance_value` reads; what is unknown is left out."""
    content: dict[str, object] = {**asdict(provenance), "tags": list(provenance.tags)}
    return {name: value for name, value in content.items() if value}


def below(frames: Path, folder: str) -> Path:
    """Return a stored folder; a database of unknown origin must not lead elsewhere.

    Raises:
        StoreError: it lies outside the root of all frames.
    """
    parts = PurePosixPath(folder).parts
    if not parts or PurePosixPath(folder).is_absolute() or ".." in parts or Path(folder).drive:
        raise StoreError(
            f"the database names the folder {folder!r}, which is not below {frames}",
            advice="do not use this database: somebody changed it, or it is damaged",
        )
    return frames / folder


def _maybe(number: float | None) -> float | None:
    """Return a Python float: drivers of databases do not know the numbers of numpy."""
    return None if number is None else float(number)
