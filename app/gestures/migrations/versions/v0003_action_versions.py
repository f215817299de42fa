"""Every action that a gesture had is kept."""

import zlib

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """The action that each gesture has now is its version 1."""
    op.add_column("gesture", sa.Column("version", sa.Integer(), nullable=False, server_default="1"))
    versions = op.create_table(
        "action_versions",
        sa.Column("number", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column(
            "gesture",
            sa.Integer(),
            sa.ForeignKey("gesture.number", ondelete="CASCADE"),
            nullable=False,
        ),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("action", sa.Text(), nullable=False),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.Column("checksum", sa.BigInteger(), nullable=False),
        sa.UniqueConstraint("gesture", "version"),
    )
    gestures = op.get_bind().execute(
        sa.text("SELECT number, action, updated_ms FROM gesture ORDER BY number")
    )
    rows = [
        {
            "gesture": number,
            "version": 1,
            "action": action,
            "created_ms": updated_ms,
            "checksum": zlib.crc32(repr((1, action, updated_ms)).encode()),
        }
        for number, action, updated_ms in gestures
    ]
    if rows:
        op.bulk_insert(versions, rows)


def downgrade() -> None:
    """Former actions are forgotten."""
    op.drop_table("action_versions")
    with op.batch_alter_table("gesture") as table:
        table.drop_column("version")
