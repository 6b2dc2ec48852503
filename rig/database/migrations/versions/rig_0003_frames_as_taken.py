"""What a camera tells of its images beside their time: bits of a grey value, doubt in the time."""

import sqlalchemy as sa
from alembic import op

revision = "rig_0003"
down_revision = "rig_0002"


def upgrade() -> None:
    """Add both; of what was stored before, the file tells the bits, and no doubt is known."""
    op.add_column("frames", sa.Column("bits", sa.Integer))
    op.add_column(
        "frames", sa.Column("uncertainty_s", sa.Double, nullable=False, server_default=sa.text("0"))
    )
