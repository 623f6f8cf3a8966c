"""Whether a play may touch what it wants to: a real bus, a real autopilot. See `hil_tests.bridge.permission`."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.can.frame import CanFrame
from drivers.can.interface import SOCKETCAN
from drivers.clock import Clock
from hil_tests.bridge.armed_watch import ArmedWatch, listen
from hil_tests.bridge.network_kind import bus_of
from hil_tests.bridge.permission import RefusedError, Touched, refusals, refusals_heard
from hil_tests.bridge.transmission import TransmitGate
from hil_tests.playback.way import Way
from hil_tests.rig.profile import Profile
from hil_tests.rig.world import World
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.failures import PHYSICAL

REHEARSED_S = 1.5  # in which every node of a simulated vehicle has sent all that it sends


async def leave_for_bus(
    scenario: Scenario, profile: Profile, channel: str, way: Way, clock: Clock
) -> TransmitGate | None:
    """Whether a vehicle's nodes may be put onto a bus, around a real autopilot as well; listens to that for seconds.

    Returns:
        What stops all that was not named; None: the bus is virtual, and takes all.

    Raises:
        RefusedError: they may not.
        OSError: the autopilot's endpoint does not open.
    """
    bus, allowed = bus_of(SOCKETCAN, channel), way.granted.transmit
    simulated = way.autopilot is None
    arms = simulated and (scenario.mission.armed or any(step.armed for step in scenario.mission.steps))
    lacking: tuple[str, ...] = ()
    if allowed is not None and not bus.virtual:  # what is sent onto a virtual bus, nobody asks
        lacking = allowed.lacking(_rehearsed(scenario, profile, simulated))
    await _ask(Touched((bus,), lacking=lacking, mavlink=way.autopilot, arms=arms), way, clock)
    return None if bus.virtual or allowed is None else TransmitGate(allowed)


def _rehearsed(scenario: Scenario, profile: Profile, simulated: bool) -> list[CanFrame]:
    """What ESCs send, and the autopilot if it is simulated."""
    rehearsal = World(scenario, profile, 0.0)
    rehearsal.advance(REHEARSED_S)
    return rehearsal.sent_by_devices() + (rehearsal.sent_by_autopilot() if simulated else [])


async def leave_for_bridge(scenario: Scenario, way: Way, clock: Clock) -> None:
    """Whether a scenario may be played between real buses, a real autopilot and the gateway; listens for seconds.

    Raises:
        RefusedError: it may not.
        OSError: the autopilot's endpoint does not open.
    """
    physical = [fault.words for fault in scenario.faults if fault.subject.target in PHYSICAL]
    if physical:
        raise RefusedError(f"{', '.join(physical)}: only a simulated vehicle has that; change what is told of it")
    buses = tuple(bus_of(SOCKETCAN, name) for name in way.bridge or ())
    await _ask(Touched(buses, bridge=bool(buses), mavlink=way.autopilot), way, clock)


async def _ask(touched: Touched, way: Way, clock: Clock) -> None:
    _refuse(refusals(touched, way.granted))
    silent = way.autopilot is None or not touched.anything_real
    heard = ArmedWatch(clock.now()) if silent else await listen(str(way.autopilot), clock)
    _refuse(refusals_heard(touched, way.granted, heard.heard()))


def _refuse(reasons: Sequence[str]) -> None:
    if reasons:
        raise RefusedError("\n".join(reasons))
