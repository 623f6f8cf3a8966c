"""Samples in, verdicts out. No bus, no socket, no clock, no logger."""
