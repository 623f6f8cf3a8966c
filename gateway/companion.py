"""The gateway as an onboard computer on the vehicle's MAVLink network: it listens, asks for streams, and speaks."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial

from drivers.clock import Clock
from drivers.mavlink.encoder import MavlinkEncoder, frames_of
from drivers.mavlink.formats import name_of
from drivers.mavlink.link import MavlinkLink
from drivers.mavlink.messages import CommandAck, CommandResult, OutgoingMessage
from drivers.mavlink.streams import StreamRequests
from drivers.mavlink.transports import Connect, open_transport
from drivers.readings import (
    AutopilotClock,
    AutopilotConflict,
    AutopilotHeartbeat,
    IdentityConflict,
    LinkState,
    Reading,
)
from gateway.computer_status import ComputerWatch
from gateway.config import Config
from gateway.config_sections import MAVLINK
from gateway.forwarded_bus import forwarded_buses
from gateway.intake import Intake
from gateway.signing.link import link_signing
from gateway.streams import streams
from gateway.supervision.autopilots import kind_of
from gateway.wiring import mavlink_decoder

log = logging.getLogger("gateway")

COMPUTER_STATUS_S = 2.0


class Companion:
    """The link to the autopilot, with what is said on it.

    It speaks with the vehicle's own system id: the configured one, or that of the one autopilot that it hears. Before
    it knows that, and while several autopilots are heard, it is silent.

    Streams that were asked for stay as they are when it ends: an interval belongs to the whole link, and what was the
    rate before, or who else has come to count on the new one, nobody can tell.

    Args:
        config: with a `mavlink` table.
        clock: stamps what is received.
        intake: gets what is heard, what is said, and readings.
        connect: opens the endpoint.

    Attributes:
        name: of the link.
        received: readings so far.
        buses: of the autopilot, that it forwards.

    Raises:
        ValueError: the configuration has no `mavlink` table.
        ConfigError: its signing key cannot be used.
    """

    def __init__(
        self,
        config: Config,
        clock: Clock,
        intake: Intake,
        connect: Connect = open_transport,
    ) -> None:
        if config.mavlink is None:
            raise ValueError("mavlink: missing, a companion needs the link to its autopilot")
        self._settings = config.mavlink
        self._link = MavlinkLink(MAVLINK, config.mavlink.endpoint, clock, connect)
        self._signing = link_signing(config.mavlink, config.files.state, clock.now())
        self._gate = None if self._signing is None else self._signing.signing
        self.buses = forwarded_buses(config, intake.decoded)
        self._decoder = mavlink_decoder(
            config.mavlink,
            config.thruster,
            navigation=config.navigation is not None,
            gate=self._gate,
            can_frames=self.buses[0].frames if self.buses else None,
        )
        self._requests = StreamRequests(partial(streams, config))
        self._computer = ComputerWatch(config.files.findings.parent)
        self._computer_s = 0.0
        self._settled = self._up = False
        self._refused_systems: set[int] = set()
        self._ignored = False
        self._encoders: dict[int, MavlinkEncoder] = {}
        self._unsent: Counter[str] = Counter()
        self._autopilot_clock: AutopilotClock | None = None
        self._clock = clock
        self._intake = intake
        self._tell_state: Callable[[LinkState], None] | None = None
        self.name, self.received = MAVLINK, 0

    async def run(self, on_state: Callable[[LinkState], None]) -> None:
        """Keeps the link alive until it is cancelled."""
        self._tell_state = on_state
        try:
            await self._link.run(self._on_bytes, on_state)
        finally:
            if self._signing is not None:
                self._signing.close(self._clock.now())

    def on_state(self, state: LinkState) -> None:
        """The state of some link: of our own, requests for streams begin anew when it is back."""
        if state.link == MAVLINK:
            self._up = state.up
            self._ask([state], state.time_s)
            self._forward([state], state.time_s)

    def advance(self, time_s: float) -> None:
        """Repeats requests that are due, and tells and asks what is due every few seconds."""
        self._ask([], time_s)
        self._forward([], time_s)
        if self._signing is not None:
            self._signing.advance(time_s)
        system = self._decoder.autopilot_system
        if system is None or not self._up:
            return
        question = self._decoder.timesync.question(system, time_s)
        if question is not None:
            self.send(question)
        if time_s - self._computer_s >= COMPUTER_STATUS_S:
            self._computer_s = time_s
            self.send(self._computer.status(time_s))

    def take_leave(self) -> None:
        """Ends what it has asked for that would go on without it for others to wonder at: the forwarding of CAN."""
        for bus in self.buses:
            for message in bus.stop(self._clock.now()):
                self.send(message)

    def send(self, message: OutgoingMessage) -> None:
        """Sends without waiting; where that cannot be, it is counted.

        An answer to this machine's own operator (system 0) is not for the link.
        """
        if isinstance(message, CommandAck) and message.target_system == 0:
            return
        system = self._decoder.autopilot_system
        if system is None:
            self._unsent["not sent: no autopilot heard"] += 1
            return
        encoder = self._encoders.get(system)
        if encoder is None:
            encoder = self._encoders[system] = MavlinkEncoder(system, self._settings.component_id, self._gate)
        now_s = self._clock.now()
        frames = encoder.encode(message, now_s)
        self._decoder.own.sent(frames, now_s)
        for frame in frames_of(frames):
            self._intake.said(frame, now_s)
            self._link.send(frame)

    def drops(self) -> Counter[str]:
        """What was thrown away or not sent, by cause."""
        return (
            self._decoder.drops + self._unsent + Counter({f"not sent: {k}": n for k, n in self._link.unsent.items()})
        )

    def decode_errors(self) -> Counter[str]:
        """What the decoder threw away, by cause."""
        return Counter(self._decoder.drops)

    def remarks(self) -> dict[str, str]:
        """What is worth saying of the link beside its counts: the autopilot's clock, where it was measured."""
        clock = self._autopilot_clock
        if clock is None:
            return {}
        wrong_ms = 500.0 * clock.round_trip_s
        return {"autopilot": f"its clock is {clock.offset_s:.3f} s behind ours, to within {wrong_ms:.1f} ms"}

    def _on_bytes(self, data: bytes, time_s: float) -> None:
        self._intake.heard(data, time_s)
        known = self._decoder.autopilot_system if self.received else None
        readings = self._decoder.decode(data, time_s)
        for answer in self._decoder.answers():
            self._tell_refusal(answer)
            self.send(answer)
        self.received += len(readings)
        for news in self._signing.news(self._decoder.drops) if self._signing is not None else ():
            log.warning("%s", news)
        for reading in readings:
            self._note(reading, known)
        self._intake.decoded(MAVLINK, readings)
        self._forward(readings, time_s)
        if readings:
            self._ask(readings, time_s)

    def _note(self, reading: Reading, known: int | None) -> None:
        """For log and summary."""
        match reading:
            case AutopilotHeartbeat(system_id=system) if system != known:
                log.info("autopilot %s, system %d", kind_of(reading), system)
            case AutopilotConflict():
                self._note_conflict(reading.system_ids)
            case IdentityConflict():
                log.warning(
                    "another program sends as system %d, component %d, as we do: set mavlink.component_id",
                    reading.system_id,
                    reading.component_id,
                )
            case AutopilotClock():
                self._autopilot_clock = reading

    def _note_conflict(self, systems: Sequence[int]) -> None:
        if len(systems) < 2:
            log.info("one autopilot again, system %d", systems[0])
            return
        ours = self._decoder.autopilot_system
        staying = "none is listened to" if ours is None else f"nothing is asked of system {ours}, which we know"
        log.warning(
            "several autopilots (systems %s): set mavlink.system_id; until then %s",
            ", ".join(map(str, systems)),
            staying,
        )

    def _tell_refusal(self, answer: OutgoingMessage) -> None:
        """Who is refused does not learn why over MAVLink: the log says it once."""
        if not (isinstance(answer, CommandAck) and answer.result == CommandResult.DENIED):
            return
        system = answer.target_system
        if system in self._settings.operators:
            advice = "want the number of a subject, and where a key is set, a signature"
        else:
            advice = f"mavlink.operators = {self._settings.operators}: add {system} if it may"
        if system not in self._refused_systems:
            self._refused_systems.add(system)
            log.warning("mavlink: a command of system %d was refused: %s", system, advice)

    def _forward(self, readings: Sequence[Reading], time_s: float) -> None:
        """The autopilot's buses: what came of them, and what to ask for."""
        if self._tell_state is None:
            return  # it does not run yet
        for bus in self.buses:
            for request in bus.update(readings, time_s):
                self.send(request)
            state = bus.state(time_s)
            if state is not None:
                self._tell_state(state)

    def _ask(self, readings: Sequence[Reading], time_s: float) -> None:
        for request in self._requests.update(readings, time_s, self._decoder.heard):
            self.send(request)
        if self._requests.settled and not self._settled:
            self._tell_streams()
        self._settled = self._requests.settled

    def _tell_streams(self) -> None:
        requests = self._requests
        ignored = not (requests.accepted or requests.refused)
        if ignored != self._ignored:
            self._ignored = ignored
            detail = "answers none of our commands" if ignored else ""
            self._intake.reading(MAVLINK, LinkState(self._clock.now(), MAVLINK, True, detail))
        if ignored:
            log.warning(
                "the autopilot answers no requests for streams; does it take commands from component %d?",
                self._settings.component_id,
            )
            return
        others = {"refused": requests.refused, "unanswered": requests.unanswered}
        named = [f"{word}: {', '.join(map(name_of, sorted(ids)))}" for word, ids in others.items() if ids]
        log.info("streams: %d granted%s", len(requests.accepted), "".join(f", {one}" for one in named))
