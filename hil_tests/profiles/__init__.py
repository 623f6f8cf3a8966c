"""Vehicles to play scenarios with: one YAML file each, and the gateway's configuration that belongs to it."""
