"""A curve knows by how much the rows of its views missed when it was made."""

import sqlalchemy as sa
from alembic import op

revision = "rig_0004"
down_revision = "rig_0003"


def upgrade() -> None:
    """Add it; of curves that were stored before nobody knows."""
    op.add_column("curves", sa.Column("row_errors", sa.Text))
