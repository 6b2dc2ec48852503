"""Every run knows who made it and of which unit it is, and a sample whether its frames went."""

import sqlalchemy as sa
from alembic import op

revision = "rig_0006"
down_revision = "rig_0005"


def upgrade() -> None:
    """Add it; of runs that were stored before nobody knows."""
    for table in ("sweeps", "calibrations", "curves"):
        op.add_column(table, sa.Column("unit", sa.String, nullable=False, server_default=""))
        op.add_column(
            table, sa.Column("provenance", sa.Text, nullable=False, server_default=sa.text("'{}'"))
        )
    op.add_column("calibrations", sa.Column("note", sa.String, nullable=False, server_default=""))
    op.add_column("samples", sa.Column("pruned_at", sa.String(32)))
