"""Ways through moving water, healthy or with a lasting loss of speed: random simulated missions, and recordings."""

from hil_tests.missions.course import KINDS, Kind
from hil_tests.missions.mission import Mission, Style, random_mission
from hil_tests.missions.passage import Passage
from hil_tests.missions.recordings import Drive, carried, read_kvlcc2, read_snapir

__all__ = [
    "KINDS",
    "Drive",
    "Kind",
    "Mission",
    "Passage",
    "Style",
    "carried",
    "random_mission",
    "read_kvlcc2",
    "read_snapir",
]
