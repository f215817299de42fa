"""Hand landmarks: where a hand is, and its 21 points, by MediaPipe's networks run by LiteRT."""
