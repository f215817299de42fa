"""Streams: what a webcam sees over minutes, with the truth beside every frame.

``scene`` holds rooms, light and cutouts, ``hands`` the drawn hand and the photographs, ``acts``
what happens before the camera, ``sets`` which gestures are enrolled and shown, ``measure`` what
is counted. ``python -m benchmarks.streams`` plays them through the pipeline.
"""
