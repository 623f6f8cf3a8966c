"""Random simulated missions in moving water, healthy or with a lasting loss of speed."""

from hil_tests.missions.course import KINDS, Kind
from hil_tests.missions.mission import Mission, Style, random_mission

__all__ = ["KINDS", "Kind", "Mission", "Style", "random_mission"]
