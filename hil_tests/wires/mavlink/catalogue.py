"""Which signals a fault's subject has on a MAVLink link."""

from __future__ import annotations

from gateway.config import Config
from gateway.config_sections import Navigation
from gateway.wiring import mavlink_thrusters
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Subject
from hil_tests.wires.mavlink.depth import depths
from hil_tests.wires.mavlink.dvl import velocities
from hil_tests.wires.mavlink.heading import headings
from hil_tests.wires.mavlink.inertial import forces, rates
from hil_tests.wires.mavlink.position import positions
from hil_tests.wires.mavlink.signal import Signal
from hil_tests.wires.mavlink.thrusters import commands, speeds

_OF_THE_VEHICLE = {
    Target.DVL: velocities,
    Target.ACCELEROMETER: forces,
    Target.GYROSCOPE: rates,
    Target.HEADING: headings,
    Target.POSITION: positions,
}
_OF_A_THRUSTER = {Target.RPM: speeds, Target.COMMAND: commands}


def signals(subject: Subject, config: Config | None = None) -> list[Signal]:
    """Signals of a subject, wherever MAVLink tells them; none for what is told elsewhere, or not at all.

    Args:
        subject: whom faults befall.
        config: of the gateway: where it reads thrusters and depth. None: no thruster is read on this link, and the
            water is the sea.
    """
    if subject.target is Target.DEPTH:
        return depths((config and config.navigation) or Navigation.model_validate({}))
    if subject.target in _OF_THE_VEHICLE:
        return _OF_THE_VEHICLE[subject.target]()
    if subject.target in _OF_A_THRUSTER and config is not None:
        of_a_thruster = _OF_A_THRUSTER[subject.target]
        wired = mavlink_thrusters(config.thruster)
        return [signal for one in wired if one.thruster == subject.thruster for signal in of_a_thruster(one)]
    return []
