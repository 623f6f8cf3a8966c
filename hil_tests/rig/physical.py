"""What a scenario's physical faults do to the simulated vehicle: rows of `failures.PHYSICAL` as values of the rig.

Kinds of thrusters' faults are a table; what is not in it is told apart by its target.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import cos, inf, radians, sin

from hil_tests.rig.faults import EscReset, FaultType, HullFault, InjectedFault, Pull, Sag
from hil_tests.rig.water import Current, SettingIn, Shear, Tide, Together, Water
from hil_tests.scenario.document import WaterBody
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault

# Water cannot begin to move at once: what would be is felt as a blow by every inertial sensor.
GUST_RAMP_MIN_S = 1.0

# Of a thruster: what it is called in the rig, and how bad it is there.
THRUSTER_FAULTS: Mapping[str, tuple[FaultType, Callable[[Mapping[str, float]], float]]] = {
    "entangled": (FaultType.ENTANGLED, lambda values: values["share"]),
    "blocked": (FaultType.BLOCKED, lambda values: values["share"]),
    "propeller_lost": (FaultType.PROPELLER_LOST, lambda values: values["share"]),
    "worn": (FaultType.WORN, lambda values: values["share"]),
    "off": (FaultType.DEAD, lambda values: values["share"]),
    "delayed": (FaultType.DELAYED, lambda values: values["delay_s"]),
    "slow": (FaultType.SLOW, lambda values: values["factor"] - 1.0),
    "reverse": (FaultType.REVERSED, lambda _: 1.0),
}
RESET = "reset"


@dataclass(frozen=True, slots=True)
class Reboot:
    """The autopilot starts anew, silent for a while."""

    at_s: float
    silent_s: float


class PhysicalFaults:
    """All of a scenario's; those that happen on wires are left out.

    Args:
        faults: of the scenario.

    Attributes:
        thrusters: by their numbers.
        resets: of ESCs, by the numbers of their thrusters.
        hull: what catches on it, or pulls at it.
        sags: of the supply.
        gusts: of the water.
        reboots: of the autopilot, in order of time.

    Raises:
        ValueError: a fault that the rig does not know.
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.thrusters: dict[int, list[InjectedFault]] = {}
        self.resets: dict[int, list[EscReset]] = {}
        self.hull: list[HullFault | Pull] = []
        self.sags: list[Sag] = []
        self.gusts: list[Water] = []
        self.reboots: list[Reboot] = []
        for fault in sorted(faults, key=lambda fault: fault.at_s):
            self._sort(fault)

    def down(self, since_s: float) -> frozenset[int]:
        """Numbers of the thrusters whose ESCs are down."""
        return frozenset(
            number for number, resets in self.resets.items() if any(reset.silent(since_s) for reset in resets)
        )

    def _sort(self, fault: Fault) -> None:
        match fault.subject.target, fault.failure:
            case Target.THRUSTER, failure:
                self._thruster(fault, failure, fault.subject.thruster or 0)
            case Target.BATTERY, "sag":
                self.sags.append(Sag(drop_v=fault.values["sag_v"], **_times(fault)))
            case Target.HULL, "net":
                self._net(fault)
            case Target.HULL, "pull":
                towards_rad = radians(fault.values["towards_deg"])
                self.hull.append(Pull(newtons=fault.values["force_n"], towards_rad=towards_rad, **_times(fault)))
            case Target.WATER, "gust":
                self.gusts += _gust(fault)
            case Target.AUTOPILOT, "reboot":
                self.reboots.append(Reboot(fault.at_s, fault.values["silent_s"]))
            case ((Target.BATTERY | Target.HULL | Target.WATER | Target.AUTOPILOT), failure):
                raise ValueError(f"failure = {failure!r}: the {fault.subject.target} has no such one")

    def _thruster(self, fault: Fault, failure: str, number: int) -> None:
        if failure == RESET:
            reset = EscReset(
                onset_s=fault.at_s,
                silent_s=fault.values["silent_s"],
                every_s=fault.values["every_s"],
                end_s=fault.until_s,
            )
            self.resets.setdefault(number, []).append(reset)
            return
        if failure not in THRUSTER_FAULTS:
            raise ValueError(f"failure = {failure!r}: want one of {', '.join([*THRUSTER_FAULTS, RESET])}")
        kind, severity_of = THRUSTER_FAULTS[failure]
        severity = severity_of(fault.values)
        if severity > 0.0:  # "slow" by a factor of 1 is none
            self.thrusters.setdefault(number, []).append(InjectedFault(type=kind, severity=severity, **_times(fault)))

    def _net(self, fault: Fault) -> None:
        if fault.values["drag_factor"] > 1.0:
            self.hull.append(HullFault(drag_factor=fault.values["drag_factor"], **_times(fault)))


def water(body: WaterBody, gusts: Sequence[Water]) -> Water:
    """All that moves: currents, tide and shear of the scenario, and its gusts."""
    parts: list[Water] = list(gusts)
    for current in body.currents:
        steady = _towards(current.speed_mps, current.towards_deg)
        sets_in = current.at_s > 0.0 or current.over_s > 0.0
        parts.append(SettingIn(steady, current.at_s, current.over_s) if sets_in else steady)
    if body.tide is not None:
        most, phase_rad = _towards(body.tide.speed_mps, body.tide.towards_deg), radians(body.tide.phase_deg)
        parts.append(Tide(most.north_mps, most.east_mps, body.tide.period_s, phase_rad, phase_rad))
    if body.shear is not None:
        surface, per_m = (
            _towards(value, body.shear.towards_deg) for value in (body.shear.surface_mps, body.shear.per_m_mps)
        )
        parts.append(Shear((surface.north_mps, surface.east_mps, 0.0), (per_m.north_mps, per_m.east_mps, 0.0)))
    return Together(tuple(parts))


def _gust(fault: Fault) -> list[Water]:
    """It sets in over the ramp, and from its end on falls for as long."""
    ramp_s = max(fault.ramp_s, GUST_RAMP_MIN_S)
    speed_mps, towards_deg = fault.values["speed_mps"], fault.values["towards_deg"]
    gust: list[Water] = [SettingIn(_towards(speed_mps, towards_deg), fault.at_s, ramp_s)]
    if fault.until_s < inf:
        gust.append(SettingIn(_towards(speed_mps, towards_deg + 180.0), fault.until_s, ramp_s))
    return gust


def _towards(speed_mps: float, towards_deg: float) -> Current:
    return Current(speed_mps * cos(radians(towards_deg)), speed_mps * sin(radians(towards_deg)))


def _times(fault: Fault) -> dict[str, float]:
    return {"onset_s": fault.at_s, "ramp_s": fault.ramp_s, "end_s": fault.until_s}
