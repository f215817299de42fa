"""Recognition on photographs: every mode of the product and MediaPipe Hands, side by side.

``sets`` reads the photographs and knows their rooms and people, ``modes`` the settings that are
compared, ``methods`` gives the product and its peer one face, ``peer`` sets the peer up, ``score``
draws the trials, ``table`` writes Markdown. ``python -m benchmarks.recognition --help``.
"""
