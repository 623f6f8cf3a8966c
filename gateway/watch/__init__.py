"""`gateway watch`: a running gateway, or a recorded dive, on a terminal."""
