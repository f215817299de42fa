"""Farhand: drive a robot arm that stands somewhere else by showing hand gestures to a webcam."""

import os

# Matrices here are small: threads of BLAS cost more than they bring (the match's 99th percentile
# rose to 50 ms with them), and would compete with the control loop. Must be set before numpy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"
