"""From the bytes of a picture to a gesture. One stage a file."""
