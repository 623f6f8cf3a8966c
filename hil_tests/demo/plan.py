"""What happens in a demonstration, and when: weeds in a thruster, then a current, then a net on the hull."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, inf, isfinite, radians, sin

from hil_tests.demo.record import SPEED, Trouble, Truth
from hil_tests.rig.embedded import SLOWED_SHARE, Surroundings
from hil_tests.rig.faults import FaultType, HullFault, InjectedFault
from hil_tests.rig.helm import box
from hil_tests.rig.water import STILL, Current, SettingIn

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
    """

    seconds: float
    weeds_s: float
    freed_s: float
    current_s: float
    net_s: float

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
        """Water and hull, for the rig."""
        current = Current(CURRENT_MPS * cos(radians(CURRENT_SET_DEG)), CURRENT_MPS * sin(radians(CURRENT_SET_DEG)))
        water = SettingIn(current, self.current_s, CURRENT_RAMP_S) if isfinite(self.current_s) else STILL
        net = HullFault(drag_factor=NET_DRAG_FACTOR, onset_s=self.net_s, ramp_s=NET_RAMP_S) if self.has_net else None
        return Surroundings(water=water, hull_faults=(net,) if net else ())

    @property
    def has_net(self) -> bool:
        """Whether there is time for the net."""
        return isfinite(self.net_s)

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
        freed = f"thruster {ENTANGLED} is cut free"
        current = f"a current sets in, up to {CURRENT_MPS} m/s @ {CURRENT_SET_DEG:03.0f}"
        return Truth(
            troubles=(weeds, net) if self.has_net else (weeds,),
            events=((start_s + self.freed_s, freed), (start_s + self.current_s, current)),
        )

    def left_out(self) -> tuple[str, ...]:
        """What there is no time for, in words."""
        left = []
        if not isfinite(self.current_s):
            left.append(f"a current (from --seconds {CURRENT_S + CURRENT_ROOM_S:.0f})")
        if not self.has_net:
            left.append(f"a net on the hull (from --seconds {NET_S + NET_ROOM_S:.0f})")
        return tuple(left)


def plan(seconds: float, weeds_s: float | None = None) -> Plan:
    """What there is time for.

    Args:
        seconds: how long the demonstration lasts.
        weeds_s: when weeds catch; None: as late as the detectors like it.
    """
    onset_s = min(LATEST_WEEDS_S, WEEDS_SHARE * seconds) if weeds_s is None else weeds_s
    return Plan(
        seconds=seconds,
        weeds_s=onset_s,
        freed_s=onset_s + WEEDS_LAST_S,
        current_s=CURRENT_S if seconds >= CURRENT_S + CURRENT_ROOM_S else inf,
        net_s=NET_S if seconds >= NET_S + NET_ROOM_S else inf,
    )
