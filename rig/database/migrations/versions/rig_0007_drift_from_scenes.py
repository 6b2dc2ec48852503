"""What scenes tell of the cameras since their calibration, as a series over time."""

import sqlalchemy as sa
from alembic import op

revision = "rig_0007"
down_revision = "rig_0006"


def upgrade() -> None:
    """Add the table; nothing was measured before."""
    op.create_table(
        "drifts",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("rig", sa.String, nullable=False),
        sa.Column("unit", sa.String, nullable=False, server_default=""),
        sa.Column("calibration_id", sa.Integer, nullable=False),
        sa.Column("measured_at", sa.String(32), nullable=False),
        sa.Column("temperature_degc", sa.Double),
        sa.Column("details", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_drifts"),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibrations.id"], name="fk_drifts_calibration_id"
        ),
    )
    op.create_index("ix_drifts_rig", "drifts", ["rig"])
