"""Farhand: drive a robot arm that stands somewhere else by showing hand gestures to a webcam."""

__version__ = "0.1.0"
