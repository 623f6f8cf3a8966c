"""`gateway check`: whether this machine can do what a configuration asks for."""
