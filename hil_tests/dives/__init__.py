"""Random dives: what the navigation sensors of a simulated vehicle say, and what is true."""

from hil_tests.dives.dive import Dive, Style, random_dive
from hil_tests.dives.manoeuvres import VEHICLES, VehicleName
from hil_tests.dives.sensors import IMU_HZ, thinned

__all__ = ["IMU_HZ", "VEHICLES", "Dive", "Style", "VehicleName", "random_dive", "thinned"]
