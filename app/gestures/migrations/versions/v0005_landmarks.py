"""Samples keep the landmarks of the hand beside its template; those so far have none."""

import zlib

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("sample", sa.Column("landmarks", sa.LargeBinary(254), nullable=True))


def downgrade() -> None:
    """Samples with landmarks lose them, and get the checksum that they would have without."""
    connection = op.get_bind()
    found = connection.execute(
        sa.text("SELECT number, id, template, created_ms FROM sample WHERE landmarks IS NOT NULL")
    ).all()
    for number, id, template, created_ms in found:
        checksum = zlib.crc32(repr((id, bytes(template), created_ms)).encode())
        connection.execute(
            sa.text("UPDATE sample SET checksum = :checksum WHERE number = :number"),
            {"checksum": checksum, "number": number},
        )
    with op.batch_alter_table("sample") as table:
        table.drop_column("landmarks")
