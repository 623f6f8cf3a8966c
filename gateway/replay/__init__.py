"""Recordings through the very pipeline of `gateway run`."""
