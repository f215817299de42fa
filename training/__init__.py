"""How the networks in ``app/pipeline/models`` are trained. See README.md beside this file."""
