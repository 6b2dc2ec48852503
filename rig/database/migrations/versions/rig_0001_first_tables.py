"""The first tables."""

import sqlalchemy as sa
from alembic import op

revision = "rig_0001"
down_revision = None


def upgrade() -> None:
    """Make all tables."""
    op.create_table(
        "sweeps",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("rig", sa.String, nullable=False),
        sa.Column("profile", sa.Text, nullable=False),
        sa.Column("versions", sa.Text, nullable=False),
        sa.Column("devices", sa.Text, nullable=False),
        sa.Column("samples_per_stop", sa.Integer, nullable=False),
        sa.Column("started_at", sa.String(32), nullable=False),
        sa.Column("ended_at", sa.String(32)),
        sa.Column("state", sa.String, nullable=False),
        sa.Column("folder", sa.String, nullable=False),
        sa.Column("note", sa.String, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_sweeps"),
        sa.CheckConstraint(
            "state IN ('running', 'finished', 'interrupted', 'failed')", name="ck_sweeps_state"
        ),
    )
    op.create_index("ix_sweeps_rig", "sweeps", ["rig"])
    op.create_table(
        "stops",
        sa.Column("sweep_id", sa.Integer, nullable=False),
        sa.Column("stop", sa.Integer, nullable=False),
        sa.Column("distance_mm", sa.Double, nullable=False),
        sa.Column("role", sa.String, nullable=False),
        sa.Column("direction", sa.String, nullable=False),
        sa.PrimaryKeyConstraint("sweep_id", "stop", name="pk_stops"),
        sa.ForeignKeyConstraint(["sweep_id"], ["sweeps.id"], name="fk_stops_sweep_id"),
        sa.CheckConstraint("role IN ('fit', 'holdout')", name="ck_stops_role"),
        sa.CheckConstraint("direction IN ('forward', 'backward')", name="ck_stops_direction"),
    )
    op.create_table(
        "samples",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("sweep_id", sa.Integer, nullable=False),
        sa.Column("stop", sa.Integer, nullable=False),
        sa.Column("sample", sa.Integer, nullable=False),
        sa.Column("reached_mm", sa.Double, nullable=False),
        sa.Column("taken_at", sa.String(32), nullable=False),
        sa.Column("temperature_degc", sa.Double),
        sa.Column("folder", sa.String, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_samples"),
        sa.UniqueConstraint("sweep_id", "stop", "sample", name="uq_samples_sweep_id_stop_sample"),
        sa.ForeignKeyConstraint(
            ["sweep_id", "stop"],
            ["stops.sweep_id", "stops.stop"],
            name="fk_samples_sweep_id_stop",
        ),
    )
    op.create_table(
        "frames",
        sa.Column("sample_id", sa.Integer, nullable=False),
        sa.Column("place", sa.Integer, nullable=False),
        sa.Column("view", sa.String, nullable=False),
        sa.Column("timestamp_s", sa.Double, nullable=False),
        sa.Column("sequence", sa.BigInteger, nullable=False),
        sa.Column("exposure_s", sa.Double),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("sample_id", "place", name="pk_frames"),
        sa.ForeignKeyConstraint(["sample_id"], ["samples.id"], name="fk_frames_sample_id"),
    )
    op.create_table(
        "measurements",
        sa.Column("sample_id", sa.Integer, nullable=False),
        sa.Column("slope_px", sa.Double),
        sa.Column("sigma_px", sa.Double),
        sa.Column("plane_a_px", sa.Double),
        sa.Column("plane_b", sa.Double),
        sa.Column("plane_c", sa.Double),
        sa.Column("centre_x_px", sa.Double),
        sa.Column("centre_y_px", sa.Double),
        sa.Column("corner_slope_px", sa.Double),
        sa.Column("corner_sigma_px", sa.Double),
        sa.Column("dense_slope_px", sa.Double),
        sa.Column("dense_sigma_px", sa.Double),
        sa.Column("failure_reason", sa.String),
        sa.Column("failure_message", sa.String),
        sa.Column("details", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("sample_id", name="pk_measurements"),
        sa.ForeignKeyConstraint(["sample_id"], ["samples.id"], name="fk_measurements_sample_id"),
    )
    op.create_table(
        "curves",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("rig", sa.String, nullable=False),
        sa.Column("sweep_id", sa.Integer, nullable=False),
        sa.Column("created_at", sa.String(32), nullable=False),
        sa.Column("curve", sa.Text, nullable=False),
        sa.Column("holdout", sa.Text, nullable=False),
        sa.Column("versions", sa.Text, nullable=False),
        sa.Column("active", sa.Boolean, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_curves"),
        sa.ForeignKeyConstraint(["sweep_id"], ["sweeps.id"], name="fk_curves_sweep_id"),
    )
    op.create_index("ix_curves_rig", "curves", ["rig"])
    op.create_index("ix_curves_sweep_id", "curves", ["sweep_id"])
