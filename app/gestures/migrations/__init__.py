"""How an older gesture database becomes today's: one script a step, run by alembic."""
