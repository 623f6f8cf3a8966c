"""Vehicle, link and gateway in one thread, at the speed of the processor: no socket, no clock, all by the real parts.

The gateway is its pure half: decoder, pipeline, encoder, requests for streams. What is left out is the shell around
it (sockets, tasks), which the tests in real time have.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.mavlink.encoder import MavlinkEncoder, frames_of
from drivers.mavlink.messages import OutgoingMessage
from drivers.mavlink.streams import StreamRequests
from drivers.readings import AutopilotHeartbeat, Reading
from gateway.config import Config
from gateway.findings import Finding
from gateway.pipeline import Factories, Outcome, Pipeline
from gateway.streams import streams
from gateway.wiring import mavlink_decoder
from hil_tests.rig.commander import Commander
from hil_tests.rig.commands import Command
from hil_tests.rig.link_conditions import IDEAL, Line, LinkConditions
from hil_tests.rig.mavlink_autopilot import MavlinkAutopilot
from hil_tests.rig.notes import ReceivedCommand, ReceivedText
from hil_tests.tests.scene import STAND_INS, Scene

START_S = 1_700_000_000.0
PERIOD_S = 0.1
SYSTEM_ID, COMPONENT_ID = 1, 192


@dataclass(frozen=True, slots=True)
class Sent:
    """What the gateway has said, when, and the HEARTBEAT that it had heard last."""

    time_s: float
    message: OutgoingMessage
    heard: AutopilotHeartbeat | None


class VirtualRig:
    """Everything, stepped together.

    Args:
        config: of the gateway.
        commander: of the autopilot.
        conditions: of the MAVLink link, each way.
        seed: of the link.
        scene: the vehicle; None: one whose trouble is as the test says.
        factories: of the detectors; they are stand-ins unless given.

    Attributes:
        time_s: now.
        scene: the vehicle.
        autopilot: the vehicle's.
        findings: what the gateway has found.
        sent: what the gateway has said.
        echo: what the gateway sends comes back to it, as from routers that are wired in a circle.
    """

    def __init__(
        self,
        config: Config,
        commander: Commander,
        conditions: LinkConditions = IDEAL,
        seed: int = 0,
        scene: Scene | None = None,
        factories: Factories = STAND_INS,
    ) -> None:
        self.time_s = START_S
        self.scene = Scene() if scene is None else scene
        self.commander = commander
        self.up, self.down = Line(conditions, 2 * seed), Line(conditions, 2 * seed + 1)
        self.autopilot = MavlinkAutopilot(self._to_gateway, commander, SYSTEM_ID)
        self.findings: list[Finding] = []
        self.sent: list[Sent] = []
        self.echo = False
        self._beside: list[MavlinkAutopilot] = []
        self._heard: AutopilotHeartbeat | None = None
        self._pipeline = Pipeline(config, factories)
        self._decoder = mavlink_decoder(config.mavlink, config.thruster)
        self._encoder = MavlinkEncoder(SYSTEM_ID, COMPONENT_ID)
        self._requests = StreamRequests(partial(streams, config))

    @property
    def texts(self) -> list[ReceivedText]:
        """What pilots read: all that arrived at the autopilot."""
        return self.autopilot.notes.texts

    @property
    def asked(self) -> list[ReceivedCommand]:
        """Commands that act on the vehicle, as they arrived at the autopilot."""
        return [one for one in self.autopilot.notes.commands if one.command in set(Command)]

    def said(self, words: str) -> bool:
        """Whether a text with these words has arrived."""
        return any(words in text.text for text in self.texts)

    def add(self, commander: Commander, system_id: int) -> MavlinkAutopilot:
        """Another autopilot on the same link."""
        self._beside.append(MavlinkAutopilot(self._to_gateway, commander, system_id))
        return self._beside[-1]

    def operator(self, command: int, *parameters: float) -> None:
        """The ground station sends a command to the gateway."""
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        message = mavlink.MAVLink_command_long_message(SYSTEM_ID, COMPONENT_ID, command, 0, *padded)
        self._to_gateway(message.pack(mavlink.MAVLink(None, srcSystem=255, srcComponent=190)))

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Let time pass; True as soon as `until` holds."""
        end_s = self.time_s + seconds
        while self.time_s < end_s:
            self.step()
            if until():
                return True
        return False

    def step(self) -> None:
        """Let 100 ms pass."""
        self.time_s += PERIOD_S
        boot_s = self.time_s - START_S + 10.0
        self.scene.step(PERIOD_S, self.commander)
        for datagram in self.down.due(self.time_s):
            if self.echo:
                self._to_gateway(datagram)
            for autopilot in (self.autopilot, *self._beside):
                autopilot.receive(self.time_s, datagram)
        for autopilot in (self.autopilot, *self._beside):
            autopilot.advance(self.time_s, self.scene.telemetry(boot_s))
        self._gateway()

    def _gateway(self) -> None:
        self._take(self._pipeline.feed("can0", list(self.scene.readings(self.time_s))))
        heard: list[Reading] = []
        for datagram in self.up.due(self.time_s):
            readings = self._decoder.decode(datagram, self.time_s)
            self._heard = next((one for one in readings if isinstance(one, AutopilotHeartbeat)), self._heard)
            self._send(self._decoder.answers())
            self._take(self._pipeline.feed("mavlink", readings))
            heard += readings
        self._take(self._pipeline.advance(self.time_s))
        self._send(self._requests.update(heard, self.time_s))

    def _to_gateway(self, datagram: bytes) -> None:
        self.up.put(self.time_s, datagram)

    def _take(self, outcomes: Iterable[Outcome]) -> None:
        for outcome in outcomes:
            if isinstance(outcome, Finding):
                self.findings.append(outcome)
            elif isinstance(outcome, OutgoingMessage):
                self._send([outcome])

    def _send(self, messages: Iterable[OutgoingMessage]) -> None:
        """As the companion: nothing while it is not known to whom."""
        for message in messages:
            if self._decoder.autopilot_system is not None:
                self.sent.append(Sent(self.time_s, message, self._heard))
                for frame in frames_of(self._encoder.encode(message)):
                    self._decoder.own.sent(frame, self.time_s)
                    self.down.put(self.time_s, frame)
