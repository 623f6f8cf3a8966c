"""What happens in a demonstration, and when: weeds in a thruster, a current, a net on the hull, a DVL that drifts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, inf, isfinite, radians, sin

from detectors.navigation import Sensor
from hil_tests.demo.record import DVL, SPEED, Trouble, Truth
from hil_tests.rig.embedded import SLOWED_SHARE, Surroundings
from hil_tests.rig.faults import FaultType, HullFault, InjectedFault
from hil_tests.rig.helm import box
from hil_tests.rig.instruments import Equipment
from hil_tests.rig.water import STILL, Current, SettingIn
from hil_tests.sensor_faults import SensorFault

ENTANGLED = 3
# Weeds wind themselves up within a second and take a quarter of the full-throttle speed.
WEEDS_RAMP_S = 1.0
WEEDS_SEVERITY = 0.25
# Until then the thruster detectors learn.
LATEST_WEEDS_S = 25.0
WEEDS_SHARE = 0.6
WEEDS_LAST_S = 10.0

CURRENT_S = 38.0
CURRENT_RAMP_S = 8.0
CURRENT_MPS, CURRENT_SET_DEG = 0.4, 85.0
# A current is worth showing if there is time to see that it raises no alarm.
CURRENT_ROOM_S = 17.0

NET_S = 60.0
NET_RAMP_S = 1.5
NET_DRAG_FACTOR = 3.7  # halves the speed
# To tell a slow vehicle from a head current takes a turn or two.
NET_ROOM_S = 20.0
# If there is more to come the net is cut free, and the speed is back well before.
NET_FREED_S = 77.0

# What the autopilot takes for its position does not follow the DVL here: each act is to be seen by itself.
DRIFT_S = 86.0
DRIFT_MPS2 = 0.04  # the linear drift of paper 003
DRIFT_ROOM_S = 24.0

# Round a square: what tells speed from flow are headings that differ.
COURSE = box(leg_s=10.0)


@dataclass(frozen=True, slots=True)
class Plan:
    """When what happens, in seconds since the start; infinite: not at all.

    Attributes:
        seconds: how long it all lasts.
        weeds_s: weeds catch thruster 3.
        freed_s: they are gone again.
        current_s: a current begins to set in.
        net_s: a net catches on the hull, and halves the speed.
        net_freed_s: it is gone again.
        drift_s: the DVL begins to drift.
    """

    seconds: float
    weeds_s: float
    freed_s: float
    current_s: float
    net_s: float
    net_freed_s: float
    drift_s: float

    def faults(self) -> Mapping[int, Sequence[InjectedFault]]:
        """Of thrusters, for the rig."""
        weeds = InjectedFault(
            type=FaultType.ENTANGLED,
            onset_s=self.weeds_s,
            ramp_s=WEEDS_RAMP_S,
            severity=WEEDS_SEVERITY,
            end_s=self.freed_s,
        )
        return {ENTANGLED: [weeds]}

    def surroundings(self) -> Surroundings:
        """Water, hull and sensors, for the rig."""
        current = Current(CURRENT_MPS * cos(radians(CURRENT_SET_DEG)), CURRENT_MPS * sin(radians(CURRENT_SET_DEG)))
        water = SettingIn(current, self.current_s, CURRENT_RAMP_S) if isfinite(self.current_s) else STILL
        return Surroundings(
            water=water,
            hull_faults=(self._net(),) if self.has_net else (),
            equipment=Equipment(faults=(self._drift(),) if self.has_drift else ()),
        )

    def _net(self) -> HullFault:
        return HullFault(drag_factor=NET_DRAG_FACTOR, onset_s=self.net_s, ramp_s=NET_RAMP_S, end_s=self.net_freed_s)

    def _drift(self) -> SensorFault:
        return SensorFault(sensor=Sensor.DVL, kind="drift", axis=0, size=DRIFT_MPS2, onset_s=self.drift_s)

    @property
    def has_net(self) -> bool:
        """Whether there is time for the net."""
        return isfinite(self.net_s)

    @property
    def has_drift(self) -> bool:
        """Whether there is time for the DVL's drift."""
        return isfinite(self.drift_s)

    def truth(self, start_s: float, weeds_shown_s: float, net_shown_s: float) -> Truth:
        """What happens, against which the gateway is judged.

        Args:
            start_s: what the plan's times count from.
            weeds_shown_s, net_shown_s: when they first showed, by the rig; NaN: not yet.
        """
        weeds = Trouble(
            subject=f"thruster {ENTANGLED}",
            catches=f"weeds catch thruster {ENTANGLED}",
            shows=f"weeds in thruster {ENTANGLED} show in its RPM",
            onset_s=start_s + self.weeds_s,
            shown_s=weeds_shown_s,
        )
        net = Trouble(
            subject=SPEED,
            catches="a net catches on the hull",
            shows=f"the net has taken {100.0 * SLOWED_SHARE:.0f} % of the speed",
            onset_s=start_s + self.net_s,
            shown_s=net_shown_s,
        )
        drift = Trouble(
            subject=DVL,
            catches="the DVL begins to drift",
            shows=f"the DVL drifts by {DRIFT_MPS2} m/s each second",
            onset_s=start_s + self.drift_s,
            shown_s=start_s + self.drift_s,
        )
        return Truth(
            troubles=(weeds, *([net] if self.has_net else []), *([drift] if self.has_drift else [])),
            events=self._events(start_s),
        )

    def _events(self, start_s: float) -> tuple[tuple[float, str], ...]:
        current = f"a current sets in, up to {CURRENT_MPS} m/s @ {CURRENT_SET_DEG:03.0f}"
        return (
            (start_s + self.freed_s, f"thruster {ENTANGLED} is cut free"),
            (start_s + self.current_s, current),
            (start_s + self.net_freed_s, "the net is cut off the hull"),
        )

    def left_out(self) -> tuple[str, ...]:
        """What there is no time for, in words."""
        left = []
        if not isfinite(self.current_s):
            left.append(f"a current (from --seconds {CURRENT_S + CURRENT_ROOM_S:.0f})")
        if not self.has_net:
            left.append(f"a net on the hull (from --seconds {NET_S + NET_ROOM_S:.0f})")
        if not self.has_drift:
            left.append(f"a DVL that drifts (from --seconds {DRIFT_S + DRIFT_ROOM_S:.0f})")
        return tuple(left)


def plan(seconds: float, weeds_s: float | None = None) -> Plan:
    """What there is time for.

    Args:
        seconds: how long the demonstration lasts.
        weeds_s: when weeds catch; None: as late as the detectors like it.
    """
    onset_s = min(LATEST_WEEDS_S, WEEDS_SHARE * seconds) if weeds_s is None else weeds_s
    has_drift = seconds >= DRIFT_S + DRIFT_ROOM_S
    return Plan(
        seconds=seconds,
        weeds_s=onset_s,
        freed_s=onset_s + WEEDS_LAST_S,
        current_s=CURRENT_S if seconds >= CURRENT_S + CURRENT_ROOM_S else inf,
        net_s=NET_S if seconds >= NET_S + NET_ROOM_S else inf,
        net_freed_s=NET_FREED_S if has_drift else inf,
        drift_s=DRIFT_S if has_drift else inf,
    )
