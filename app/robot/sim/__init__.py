"""The simulated arm. The only folder that imports pybullet."""
