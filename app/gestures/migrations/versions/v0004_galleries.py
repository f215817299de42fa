"""Several people keep their own gestures; those so far are everybody's."""

import time
import zlib

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

NAMES = {"uq": "%(table_name)s_%(column_0_name)s_key"}
"""SQLite does not name the constraint that goes; PostgreSQL names it so."""
STARTED_MS = 60_000
"""What a gesture was enrolled with sooner after the first one was the starter set's."""


def upgrade() -> None:
    """Make the shared gallery, and put all gestures into it."""
    connection = op.get_bind()
    galleries = op.create_table(
        "galleries",
        sa.Column("number", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column("id", sa.String(32), nullable=False, unique=True),
        sa.Column("name", sa.String(60), nullable=False),
        sa.Column("name_key", sa.String(240), nullable=False, unique=True),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.Column("checksum", sa.BigInteger(), nullable=False),
    )
    first = connection.execute(sa.text("SELECT min(created_ms) FROM gesture")).scalar()
    created_ms = time.time_ns() // 1_000_000 if first is None else first + STARTED_MS
    fields = ("shared", "Shared", "shared", created_ms)
    row = dict(zip(("id", "name", "name_key", "created_ms"), fields, strict=True))
    # Without its number, which the sequence of a server's database would not know of.
    op.bulk_insert(galleries, [{**row, "checksum": zlib.crc32(repr(fields).encode())}])
    with op.batch_alter_table("gesture", naming_convention=NAMES) as table:
        table.add_column(
            sa.Column(
                "gallery",
                sa.Integer(),
                sa.ForeignKey("galleries.number", name="gesture_gallery_fkey", ondelete="CASCADE"),
                nullable=False,
                server_default="1",
            )
        )
        table.drop_constraint("gesture_name_key_key", type_="unique")
        table.create_unique_constraint("gesture_gallery_key", ["gallery", "name_key"])


def downgrade() -> None:
    """Only the shared gestures stay."""
    others = "SELECT number FROM gesture WHERE gallery <> 1"
    for part in ("sample", "action_versions"):
        op.execute(f"DELETE FROM {part} WHERE gesture IN ({others})")
    op.execute("DELETE FROM gesture WHERE gallery <> 1")
    with op.batch_alter_table("gesture", naming_convention=NAMES) as table:
        table.drop_constraint("gesture_gallery_key", type_="unique")
        table.drop_constraint("gesture_gallery_fkey", type_="foreignkey")
        table.drop_column("gallery")
        table.create_unique_constraint("gesture_name_key_key", ["name_key"])
    op.drop_table("galleries")
