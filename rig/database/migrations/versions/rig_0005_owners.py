"""Every sweep has one owner, and its state says what is still to do."""

import sqlalchemy as sa
from alembic import op

revision = "rig_0005"
down_revision = "rig_0004"

_STATES = "state IN ('taking', 'taken', 'concluded', 'failed')"
_COLUMNS = (
    "id, rig, profile, versions, devices, samples_per_stop, started_at, ended_at, state, folder, "
    "note, calibration_id"
)
_IS_WHOLE = (
    "(SELECT count(*) FROM samples WHERE samples.sweep_id = sweeps.id"
    " AND samples.sample < sweeps.samples_per_stop)"
    " >= samples_per_stop * (SELECT count(*) FROM stops WHERE stops.sweep_id = sweeps.id)"
)
_HAS_CURVE = "EXISTS (SELECT 1 FROM curves WHERE curves.sweep_id = sweeps.id)"
# A sweep was `finished` before its curve was stored, and `running` for ever when it was killed.
_STATE = (
    f"CASE WHEN {_HAS_CURVE} AND (state = 'finished' OR {_IS_WHOLE}) THEN 'concluded'"
    f" WHEN state = 'failed' THEN 'failed' WHEN {_IS_WHOLE} THEN 'taken' ELSE 'taking' END"
)


def upgrade() -> None:
    """Add the table of owners, and name the states anew."""
    op.create_table(
        "leases",
        sa.Column("what", sa.String, nullable=False),
        sa.Column("token", sa.String(32), nullable=False),
        sa.Column("host", sa.String, nullable=False),
        sa.Column("pid", sa.BigInteger, nullable=False),
        sa.Column("process", sa.String, nullable=False),
        sa.Column("since", sa.String(32), nullable=False),
        sa.Column("heartbeat", sa.String(32), nullable=False),
        sa.PrimaryKeyConstraint("what", name="pk_leases"),
    )
    if op.get_bind().dialect.name == "sqlite":
        _rewrite_sweeps()
        return
    op.drop_constraint("ck_sweeps_state", "sweeps", type_="check")
    op.execute(f"UPDATE sweeps SET state = {_STATE}")  # noqa: S608
    op.create_check_constraint("ck_sweeps_state", "sweeps", _STATES)


def _rewrite_sweeps() -> None:
    """Write the whole table anew: SQLite cannot change a constraint of one that exists."""
    op.create_table(
        "sweeps_anew",
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
        sa.Column("calibration_id", sa.Integer),
        sa.PrimaryKeyConstraint("id", name="pk_sweeps"),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibrations.id"], name="fk_sweeps_calibration_id"
        ),
        sa.CheckConstraint(_STATES, name="ck_sweeps_state"),
    )
    columns = _COLUMNS.replace("state", f"{_STATE} AS state")
    op.execute(f"INSERT INTO sweeps_anew ({_COLUMNS}) SELECT {columns} FROM sweeps")  # noqa: S608
    op.drop_table("sweeps")
    op.rename_table("sweeps_anew", "sweeps")
    op.create_index("ix_sweeps_rig", "sweeps", ["rig"])
