"""Stretches of readings through the pipeline at once: what replay does in place of reading by reading."""
