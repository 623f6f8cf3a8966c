"""A simulated vehicle: thrusters on one battery, and a hull that they push about; by default a BlueROV2 Heavy."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from hil_tests.rig.battery import Battery, BatteryParameters
from hil_tests.rig.faults import HullFault, InjectedFault, Pull, Sag
from hil_tests.rig.hull import (
    BLUEROV2_HEAVY,
    HALF_SQRT2,
    MIXER,
    THRUSTERS,
    Hull,
    HullParameters,
    Motion,
    mix,
)
from hil_tests.rig.layout import Layout
from hil_tests.rig.thruster import T200, SimulatedThruster, ThrusterParameters
from hil_tests.rig.tilt import LIGHT, TiltParameters
from hil_tests.rig.water import STILL, Water

__all__ = [
    "BLUEROV2_HEAVY",
    "HALF_SQRT2",
    "MIXER",
    "THRUSTERS",
    "Battery",
    "BatteryParameters",
    "Build",
    "Hull",
    "HullParameters",
    "Motion",
    "Vehicle",
    "mix",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """What a vehicle is made of.

    Attributes:
        layout: of the thrusters.
        thrusters: what they are, one for each place in the layout, or one for all of them.
        hull, tilt, battery: see there.

    Raises:
        ValueError: there are more or fewer thrusters than places for them.
    """

    layout: Layout = BLUEROV2_HEAVY
    thrusters: tuple[ThrusterParameters, ...] = (T200,)
    hull: HullParameters = HullParameters()  # noqa: RUF009  frozen
    tilt: TiltParameters = LIGHT
    battery: BatteryParameters = BatteryParameters()  # noqa: RUF009

    def __post_init__(self) -> None:
        if len(self.thrusters) not in (1, len(self.layout)):
            raise ValueError(
                f"{len(self.thrusters)} thrusters: want one for each of {len(self.layout)} places, or one"
            )

    @property
    def each_thruster(self) -> tuple[ThrusterParameters, ...]:
        """One for each place."""
        return self.thrusters if len(self.thrusters) == len(self.layout) else self.thrusters * len(self.layout)


class Vehicle:
    """Thrusters, a battery and a hull, stepped together.

    Args:
        period_s: time from step to step.
        seed: of all sensor noise.
        faults: what happens to which thruster, by its number from 1.
        build: what it is made of.
        water: in which it moves.
        hull_faults: what catches on its hull, or pulls at it.
        sags: of the supply.
        motion: to begin with.

    Attributes:
        layout: of its thrusters.
        thrusters: by their order.
        battery: of all of them.
        hull: as it is.
        clean_hull: as it would move with nothing caught on it, from the same thrusts.

    Raises:
        ValueError: a fault names a thruster that is not there.
    """

    def __init__(
        self,
        period_s: float,
        seed: int,
        faults: Mapping[int, Sequence[InjectedFault]] | None = None,
        build: Build = Build(),
        water: Water = STILL,
        hull_faults: Sequence[HullFault | Pull] = (),
        sags: Sequence[Sag] = (),
        motion: Motion | None = None,
    ) -> None:
        by_thruster = dict(faults or {})
        count = len(build.layout)
        unknown = sorted(set(by_thruster) - set(range(1, count + 1)))
        if unknown:
            raise ValueError(f"faults on thrusters {unknown}: want numbers from 1 to {count}")
        self._period_s = period_s
        self.layout = build.layout
        self._sags = tuple(sags)
        self.thrusters = [
            SimulatedThruster(period_s, seed * count + index, parameters, by_thruster.get(index + 1, ()))
            for index, parameters in enumerate(build.each_thruster)
        ]
        self.battery = Battery(build.battery)
        self.hull = Hull(build.hull, motion, water, hull_faults, build.layout, build.tilt)
        self.clean_hull = Hull(build.hull, motion, water, (), build.layout, build.tilt) if hull_faults else self.hull

    def step(self, time_s: float, commands: Sequence[float], undriven: Collection[int] = ()) -> Motion:
        """Advance by one period.

        Args:
            time_s: since the start.
            commands: one of -1 to 1 per thruster.
            undriven: numbers, from 1, of the thrusters whose ESCs are down.
        """
        supply_v = self.battery.voltage_v
        for number, (thruster, command) in enumerate(zip(self.thrusters, commands, strict=True), start=1):
            thruster.step(time_s, command, supply_v, number not in undriven)
        sag_v = sum(sag.volts(time_s) for sag in self._sags)
        self.battery.step(sum(thruster.state.supply_a for thruster in self.thrusters), self._period_s, sag_v)
        thrusts_n = [thruster.thrust_n for thruster in self.thrusters]
        if self.clean_hull is not self.hull:
            self.clean_hull.step(thrusts_n, self._period_s)
        return self.hull.step(thrusts_n, self._period_s)
