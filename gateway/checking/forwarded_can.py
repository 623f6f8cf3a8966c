"""The part of `gateway check` for a CAN bus of the autopilot: whether it is forwarded, and what comes of it."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress

from drivers.can.frame import CanFrame
from drivers.clock import Clock
from drivers.mavlink.can_filter import forwarding_ids
from drivers.mavlink.can_forward import SILENCE_S, CanForward
from drivers.mavlink.encoder import MavlinkEncoder, frames_of
from drivers.mavlink.forwarded_frames import ForwardedFrames
from drivers.mavlink.link import MavlinkLink
from drivers.mavlink.messages import CommandResult, OutgoingMessage
from drivers.mavlink.signing import Signing
from drivers.readings import LinkState, Reading
from gateway.checking.result import CheckResult
from gateway.config import Config
from gateway.config_sections import MAVLINK, CanBus, Mavlink
from gateway.problems import ConfigError
from gateway.signing.link import begun
from gateway.wiring import can_decoder, mavlink_decoder

# a heartbeat is heard within three seconds; then it answers, or does not
ASK_S = 3.0 + SILENCE_S + 0.5
# what is forwarded is counted for so long
COUNT_S = 2.0
STEP_S = 0.1
NODE_MASK = 0x7F
SHOWN = 12


class Asking:
    """Asks for one bus, and keeps what comes. It owns no socket, and is told the time.

    Args:
        bus: of the configuration.
        config: the rest of it.
        mavlink: the link.
        signing: of the link; None: unsigned.
        send: takes a frame away.

    Attributes:
        frames: of the bus.
        state: newest state of the bus; None before the first.
        forward: what is known of the forwarding.
    """

    def __init__(
        self, bus: CanBus, config: Config, mavlink: Mavlink, signing: Signing | None, send: Callable[[bytes], None]
    ) -> None:
        self.frames: list[CanFrame] = []
        self.state: LinkState | None = None
        self._frames = ForwardedFrames(Counter())
        self._decoder = mavlink_decoder(mavlink, (), gate=signing, can_frames=self._frames)
        ids = forwarding_ids(can_decoder(bus, config.thruster).filters())
        self.forward = CanForward(bus.name, int(bus.channel), ids)
        self._component, self._signing, self._send = mavlink.component_id, signing, send
        self._encoder: MavlinkEncoder | None = None

    @property
    def autopilot_heard(self) -> bool:
        """Whether there is somebody to ask."""
        return self._decoder.autopilot_system is not None

    def hear(self, data: bytes, time_s: float) -> None:
        """Takes what was received."""
        readings = self._decoder.decode(data, time_s)
        self.frames += self.forward.frames(self._frames.take())
        self.advance(time_s, readings)

    def advance(self, time_s: float, readings: Iterable[Reading] = ()) -> None:
        """Takes the time; asks what is due."""
        self._say(self.forward.update(readings, time_s), time_s)
        self.state = self.forward.state(time_s) or self.state

    def stop(self, time_s: float) -> None:
        """Ends what it has asked for."""
        self._say(self.forward.stop(time_s), time_s)

    def _say(self, messages: Sequence[OutgoingMessage], time_s: float) -> None:
        system = self._decoder.autopilot_system
        if system is None:
            return
        if self._encoder is None:
            self._encoder = MavlinkEncoder(system, self._component, self._signing)
        for message in messages:
            for frame in frames_of(self._encoder.encode(message, time_s)):
                self._send(frame)


def check_forwarded(bus: CanBus, config: Config, mavlink: Mavlink) -> CheckResult:
    """Asks the autopilot to forward the bus for a few seconds, and ends that."""
    clock = Clock()
    link = MavlinkLink(MAVLINK, mavlink.endpoint, clock)
    try:
        signing = begun(mavlink, config.files.state, clock.now())
    except ConfigError:
        return CheckResult(
            f"can {bus.name}", False, "not asked for: no signing key", "mend mavlink.signing_key first"
        )
    asking = Asking(bus, config, mavlink, signing, link.send)
    asyncio.run(_ask(asking, link, clock))
    return judged(bus, asking)


async def _ask(asking: Asking, link: MavlinkLink, clock: Clock) -> None:
    listening = asyncio.create_task(link.run(asking.hear, lambda _: None))
    end_s, counting = clock.now() + ASK_S, False
    try:
        while clock.now() < end_s:
            await asyncio.sleep(STEP_S)
            asking.advance(clock.now())
            if asking.state is not None and not counting:
                counting, end_s = True, clock.now() + (COUNT_S if asking.state.up else 0.0)
                asking.frames.clear()
        asking.stop(clock.now())
    finally:
        listening.cancel()
        with suppress(asyncio.CancelledError):
            await listening


def judged(bus: CanBus, asking: Asking) -> CheckResult:
    """What follows from what came."""
    subject, name = f"can {bus.name}", f"the autopilot's CAN{bus.channel}"
    if asking.frames:
        rate = f"{len(asking.frames) / COUNT_S:.0f} frames/s"
        return CheckResult(subject, True, f"{name} is forwarded: {rate} {_senders(bus, asking.frames)}")
    if not asking.autopilot_heard:
        return CheckResult(subject, False, f"{name}: no autopilot heard that could be asked", "see mavlink")
    if asking.forward.drops:
        remedy = "close the program that asks for it (Mission Planner, DroneCAN GUI)"
        return CheckResult(subject, False, f"another bus is forwarded, and not {name}", remedy)
    if asking.state is not None and asking.state.up:
        return CheckResult(subject, True, f"{name} is forwarded; nothing came in {COUNT_S:g} s: are the ESCs on?")
    detail = "autopilot does not answer" if asking.state is None else asking.state.detail
    return CheckResult(subject, False, f"{name}: {detail}", _remedy(bus, asking.forward.refused))


def _senders(bus: CanBus, frames: Sequence[CanFrame]) -> str:
    """Who is on the bus: the nodes of DroneCAN; else identifiers, which are all that is known."""
    if bus.protocol == "dronecan":
        return f"from nodes {_listed(str(one) for one in sorted({one.identifier & NODE_MASK for one in frames}))}"
    return f"with {_listed(f'{one:#x}' for one in sorted({one.identifier for one in frames}))}"


def _listed(words: Iterable[str]) -> str:
    shown = list(words)
    more = [f"{len(shown) - SHOWN} more"] if len(shown) > SHOWN else []
    return ", ".join([*shown[:SHOWN], *more])


def _remedy(bus: CanBus, refused: int | None) -> str:
    if refused is None:
        return "does it take commands from a companion (mavlink.component_id, its MAV_OPTIONS)?"
    if refused == CommandResult.FAILED:
        return f"set CAN_P{bus.channel}_DRIVER = 1, and restart the autopilot; or name another of its buses"
    return 'read the bus directly, by an adapter of this machine: interface = "socketcan"'
