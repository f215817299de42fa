"""Gestures that are enrolled but not matched yet."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """All gestures so far are active."""
    op.add_column(
        "gesture", sa.Column("active", sa.Boolean(), nullable=False, server_default=sa.true())
    )


def downgrade() -> None:
    """Inactive gestures become active: older versions know no others."""
    with op.batch_alter_table("gesture") as table:
        table.drop_column("active")
