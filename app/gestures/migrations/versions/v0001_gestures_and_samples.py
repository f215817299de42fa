"""Gestures, their samples, and the counter of changes."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the three tables, and the counter's one row."""
    op.create_table(
        "gesture",
        sa.Column("number", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column("id", sa.String(32), nullable=False, unique=True),
        sa.Column("name", sa.String(60), nullable=False),
        sa.Column("name_key", sa.String(240), nullable=False, unique=True),
        sa.Column("action", sa.Text(), nullable=False),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.Column("updated_ms", sa.BigInteger(), nullable=False),
        sa.Column("checksum", sa.BigInteger(), nullable=False),
    )
    op.create_table(
        "sample",
        sa.Column("number", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column("id", sa.String(32), nullable=False, unique=True),
        sa.Column(
            "gesture",
            sa.Integer(),
            sa.ForeignKey("gesture.number", ondelete="CASCADE"),
            nullable=False,
        ),
        sa.Column("template", sa.LargeBinary(600), nullable=False),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.Column("checksum", sa.BigInteger(), nullable=False),
    )
    op.create_index("ix_sample_gesture", "sample", ["gesture"])
    gallery = op.create_table(
        "gallery",
        sa.Column("id", sa.Integer(), primary_key=True, autoincrement=False),
        sa.Column("version", sa.BigInteger(), nullable=False),
    )
    op.bulk_insert(gallery, [{"id": 1, "version": 0}])


def downgrade() -> None:
    """Drop everything."""
    op.drop_table("gallery")
    op.drop_table("sample")
    op.drop_table("gesture")
