"""What is measured, and how; the figures stand in RESULTS.md."""
