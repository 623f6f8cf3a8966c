"""Vehicles to play scenarios with: what each is made of, by one YAML file."""

from hil_tests.profiles.loading import load_profile, parse_profile, profile_names
from hil_tests.rig.profile import Profile

__all__ = ["Profile", "load_profile", "parse_profile", "profile_names"]
