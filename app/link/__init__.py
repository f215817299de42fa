"""What crosses between the gateway and a robot node, and its two ends over Zenoh."""
