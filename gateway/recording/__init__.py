"""Recordings of ours: everything that came in and went out, in MCAP files."""
