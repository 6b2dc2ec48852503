"""Geometric calibrations; a sweep and a curve know which one they were measured with."""

import sqlalchemy as sa
from alembic import op

revision = "rig_0002"
down_revision = "rig_0001"


def upgrade() -> None:
    """Add the table and a reference to it; what was stored before was measured with none."""
    op.create_table(
        "calibrations",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("rig", sa.String, nullable=False),
        sa.Column("created_at", sa.String(32), nullable=False),
        sa.Column("geometry", sa.Text, nullable=False),
        sa.Column("quality", sa.Text, nullable=False),
        sa.Column("profile", sa.Text, nullable=False),
        sa.Column("versions", sa.Text, nullable=False),
        sa.Column("devices", sa.Text, nullable=False),
        sa.Column("temperature_degc", sa.Double),
        sa.Column("width_px", sa.Integer, nullable=False),
        sa.Column("height_px", sa.Integer, nullable=False),
        sa.Column("active", sa.Boolean, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_calibrations"),
    )
    op.create_index("ix_calibrations_rig", "calibrations", ["rig"])
    for table in ("sweeps", "curves"):
        # Within the column, because SQLite cannot add a constraint to a table that exists.
        op.add_column(
            table,
            sa.Column(
                "calibration_id",
                sa.Integer,
                sa.ForeignKey("calibrations.id", name=f"fk_{table}_calibration_id"),
            ),
            inline_references=True,
        )
