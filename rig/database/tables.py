"""The tables; `migrations/` makes them, and a test holds both together."""

from datetime import datetime

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    Double,
    ForeignKey,
    ForeignKeyConstraint,
    MetaData,
    String,
    UniqueConstraint,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship

from rig.database.columns import CanonicalJson, UtcTime


class Row(DeclarativeBase):
    """Every table; numbers with a fraction are 64 bit, so that they come back to the last digit."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_N_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map = {  # noqa: RUF012  (SQLAlchemy declares it so)
        float: Double(),
        datetime: UtcTime(),
        dict[str, object]: CanonicalJson(),
    }


class SweepRow(Row):
    """One sweep with its provenance."""

    __tablename__ = "sweeps"
    __table_args__ = (
        CheckConstraint("state IN ('taking', 'taken', 'concluded', 'failed')", name="state"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    rig: Mapped[str] = mapped_column(index=True)
    profile: Mapped[dict[str, object]]
    versions: Mapped[dict[str, object]]
    devices: Mapped[dict[str, object]]
    samples_per_stop: Mapped[int]
    started_at: Mapped[datetime]
    ended_at: Mapped[datetime | None]
    state: Mapped[str]
    folder: Mapped[str]
    note: Mapped[str]
    calibration_id: Mapped[int | None] = mapped_column(ForeignKey("calibrations.id"))
    unit: Mapped[str] = mapped_column(server_default="")
    provenance: Mapped[dict[str, object]] = mapped_column(server_default=text("'{}'"))
    stops: Mapped[list["StopRow"]] = relationship(order_by="StopRow.stop")


class StopRow(Row):
    """One planned halt of the stage."""

    __tablename__ = "stops"
    __table_args__ = (
        CheckConstraint("role IN ('fit', 'holdout')", name="role"),
        CheckConstraint("direction IN ('forward', 'backward')", name="direction"),
    )

    sweep_id: Mapped[int] = mapped_column(ForeignKey("sweeps.id"), primary_key=True)
    stop: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    distance_mm: Mapped[float]
    role: Mapped[str]
    direction: Mapped[str]


class SampleRow(Row):
    """One multi-view taken at a stop."""

    __tablename__ = "samples"
    __table_args__ = (
        UniqueConstraint("sweep_id", "stop", "sample"),
        ForeignKeyConstraint(["sweep_id", "stop"], ["stops.sweep_id", "stops.stop"]),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    sweep_id: Mapped[int]
    stop: Mapped[int]
    sample: Mapped[int]
    reached_mm: Mapped[float]
    taken_at: Mapped[datetime]
    temperature_degc: Mapped[float | None]
    folder: Mapped[str]
    pruned_at: Mapped[datetime | None]
    planned: Mapped[StopRow] = relationship(lazy="joined", innerjoin=True)
    frames: Mapped[list["FrameRow"]] = relationship(order_by="FrameRow.place", lazy="selectin")


class FrameRow(Row):
    """One image of a sample; its pixels are a PNG file."""

    __tablename__ = "frames"

    sample_id: Mapped[int] = mapped_column(ForeignKey("samples.id"), primary_key=True)
    place: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    view: Mapped[str]
    timestamp_s: Mapped[float]
    sequence: Mapped[int] = mapped_column(BigInteger)
    exposure_s: Mapped[float | None]
    bits: Mapped[int | None]
    uncertainty_s: Mapped[float] = mapped_column(server_default=text("0"))
    sha256: Mapped[str] = mapped_column(String(64))


class MeasurementRow(Row):
    """What was derived from a sample, or why nothing could be."""

    __tablename__ = "measurements"

    sample_id: Mapped[int] = mapped_column(ForeignKey("samples.id"), primary_key=True)
    slope_px: Mapped[float | None]
    sigma_px: Mapped[float | None]
    plane_a_px: Mapped[float | None]
    plane_b: Mapped[float | None]
    plane_c: Mapped[float | None]
    centre_x_px: Mapped[float | None]
    centre_y_px: Mapped[float | None]
    corner_slope_px: Mapped[float | None]
    corner_sigma_px: Mapped[float | None]
    dense_slope_px: Mapped[float | None]
    dense_sigma_px: Mapped[float | None]
    failure_reason: Mapped[str | None]
    failure_message: Mapped[str | None]
    details: Mapped[dict[str, object]]


class CurveRow(Row):
    """A depth-slope curve of one rig."""

    __tablename__ = "curves"

    id: Mapped[int] = mapped_column(primary_key=True)
    rig: Mapped[str] = mapped_column(index=True)
    sweep_id: Mapped[int] = mapped_column(ForeignKey("sweeps.id"), index=True)
    created_at: Mapped[datetime]
    curve: Mapped[dict[str, object]]
    holdout: Mapped[dict[str, object]]
    versions: Mapped[dict[str, object]]
    active: Mapped[bool]
    calibration_id: Mapped[int | None] = mapped_column(ForeignKey("calibrations.id"))
    row_errors: Mapped[dict[str, object] | None]
    unit: Mapped[str] = mapped_column(server_default="")
    provenance: Mapped[dict[str, object]] = mapped_column(server_default=text("'{}'"))


class CalibrationRow(Row):
    """A geometric calibration of one rig."""

    __tablename__ = "calibrations"

    id: Mapped[int] = mapped_column(primary_key=True)
    rig: Mapped[str] = mapped_column(index=True)
    created_at: Mapped[datetime]
    geometry: Mapped[dict[str, object]]
    quality: Mapped[dict[str, object]]
    profile: Mapped[dict[str, object]]
    versions: Mapped[dict[str, object]]
    devices: Mapped[dict[str, object]]
    temperature_degc: Mapped[float | None]
    width_px: Mapped[int]
    height_px: Mapped[int]
    active: Mapped[bool]
    unit: Mapped[str] = mapped_column(server_default="")
    note: Mapped[str] = mapped_column(server_default="")
    provenance: Mapped[dict[str, object]] = mapped_column(server_default=text("'{}'"))


class DriftRow(Row):
    """What one scene told of the cameras of a rig since its calibration."""

    __tablename__ = "drifts"

    id: Mapped[int] = mapped_column(primary_key=True)
    rig: Mapped[str] = mapped_column(index=True)
    unit: Mapped[str] = mapped_column(server_default="")
    calibration_id: Mapped[int] = mapped_column(ForeignKey("calibrations.id"))
    measured_at: Mapped[datetime]
    temperature_degc: Mapped[float | None]
    details: Mapped[dict[str, object]]


class LeaseRow(Row):
    """Which program works on something that only one may work on; no row where none does."""

    __tablename__ = "leases"

    what: Mapped[str] = mapped_column(primary_key=True)
    token: Mapped[str] = mapped_column(String(32))
    host: Mapped[str]
    pid: Mapped[int] = mapped_column(BigInteger)
    process: Mapped[str]
    since: Mapped[datetime]
    heartbeat: Mapped[datetime]
