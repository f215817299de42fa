"""The web server: sessions, REST, pictures, 3D view; wires the other packages together."""
