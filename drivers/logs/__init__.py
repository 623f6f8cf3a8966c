"""Logs as input: what was recorded of buses and autopilots, whole or damaged, as blocks of what drivers decode."""
