"""Devices around a real autopilot, or its simulator: ESCs and sensors are played, all else is its own.

| what | from where | to where |
|---|---|---|
| commands | the bus; where nobody commands there, servo outputs, as frames (see `servo_outputs`) | ESC nodes |
| reports | ESC nodes, with whatever is wrong with their thrusters | the bus |
| DVL, acoustic positions | made from the motion that the autopilot tells, see `hil_tests.rig.heard_motion` | both |
| all that the autopilot says | its link | the gateway |
| all that the gateway says | its link | the autopilot |

The sensors speak as their extensions for BlueOS do. What is wrong with them is heard by the autopilot as well: the
wire to it is in here, that to the gateway is where all its packets pass.

Whoever plays this steps it as it steps a simulated vehicle, and hands it what comes from the autopilot.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from enum import Enum, auto

from drivers.can.frame import CanFrame
from drivers.clock import Clock
from drivers.mavlink import formats
from drivers.mavlink.autopilot import AUTOPILOT_COMPONENT
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.endpoint import parse_endpoint
from drivers.mavlink.frames import FrameScanner, Packet
from drivers.mavlink.signing import Signing, SigningKey
from drivers.mavlink.streams import Stream, StreamRequests
from drivers.mavlink.transports import open_transport
from drivers.readings import Reading, ThrusterCommand
from gateway.config import parse
from hil_tests.bridge.armed_watch import ArmedWatch
from hil_tests.bridge.permission import Granted
from hil_tests.dive_logs.senders import side_of
from hil_tests.playback.attached_sensors import AttachedSensors
from hil_tests.playback.listening import HeardModes, Listener
from hil_tests.playback.servo_outputs import ServoOutputs
from hil_tests.rig.heard_motion import HEARD, HeardMotion
from hil_tests.rig.notes import Notes
from hil_tests.rig.profile import Profile
from hil_tests.rig.truth import ModeChange, Truth
from hil_tests.rig.world import World
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.failures import SENSORS, Target
from hil_tests.wires.mavlink_wire import MavlinkWire
from hil_tests.wires.way import Towards

COMPONENT = 193  # MAV_COMP_ID_ONBOARD_COMPUTER3: who asks the autopilot for what is needed here
RATE_HZ = 20.0
CHOICE_S = 2.0  # an autopilot that commands ESCs on the bus does it all the time
HERE_ONLY = frozenset({Target.HULL, Target.WATER, Target.AUTOPILOT})


class CommandSource(Enum):
    """Where the ESCs' commands come from; decided once."""

    UNKNOWN = auto()
    BUS = auto()
    SERVO_OUTPUTS = auto()


class AttachedDevices:
    """See the module's text. Told the time; it never waits.

    Args:
        scenario: faults of thrusters, battery and sensors are taken from it, and the seed; nobody flies its mission.
        profile: what the vehicle is.
        start_s: of the play, unix seconds.
        send: takes bytes to the autopilot.
        key: 32 bytes, by which the link is signed; None: it is not.

    Attributes:
        drops: what of the autopilot's bytes could not be read, by cause.
        start_s: of the play.
        lost: why the autopilot's link is gone; "": it is not.

    Raises:
        ValueError: scenario and profile do not go together, or a fault that only a simulated vehicle can have.
    """

    def __init__(
        self,
        scenario: Scenario,
        profile: Profile,
        start_s: float,
        send: Callable[[bytes], None],
        key: bytes | None = None,
    ) -> None:
        _check(scenario)
        config = parse(profile.gateway_toml(), profile.folder)
        self._world = World(scenario, profile, start_s, autopilot=False)
        self._send, self.start_s = send, start_s
        self.lost = ""
        self._commands = ServoOutputs(config, profile)
        self._side = side_of(config.can[0], config)
        self._source = CommandSource.UNKNOWN
        self._by_autopilot: list[CanFrame] = []
        self._datagrams: list[tuple[float, bytes]] = []
        self._gateway_component = None if config.mavlink is None else config.mavlink.component_id
        self._decoder = MavlinkDecoder(self._commands.wired, COMPONENT)
        self.drops: Counter[str] = Counter()
        self._scanner = FrameScanner(self._decoder.wanted | HEARD, self.drops)
        self._signing = None if key is None else Signing(SigningKey(key), start_s, link_id=COMPONENT)
        self._encoder: MavlinkEncoder | None = None
        wanted = [Stream(message_id, RATE_HZ) for message_id in (*self._commands.messages, *sorted(HEARD))]
        self._requests = StreamRequests(lambda _autopilot: wanted)
        self._news: list[Reading] = []
        self._heard, self._listener = HeardModes(), Listener(key)
        self._watch = ArmedWatch(start_s)
        self._motion = HeardMotion()
        self._sensors = AttachedSensors(profile.sensors, scenario.seed, self._signing)
        of_sensors = [fault for fault in scenario.faults if fault.subject.target in SENSORS]
        self._wire = MavlinkWire(of_sensors, start_s, scenario.seed, key, config)

    @property
    def notes(self) -> Notes:
        """What the gateway has said to the autopilot, and the autopilot's answers."""
        return self._listener.notes

    @property
    def modes(self) -> list[ModeChange]:
        """Of the autopilot; one more with each change."""
        return self._heard.modes

    @property
    def streams(self) -> StreamRequests:
        """What became of the requests for messages."""
        return self._requests

    def from_autopilot(self, time_s: float, data: bytes) -> None:
        """MAVLink has come from the autopilot, cut anywhere."""
        self._datagrams.append((time_s, data))
        self._watch.feed(data, time_s)
        for packet in self._scanner.feed(data, time_s):
            self._take(packet, time_s)

    def trouble(self, time_s: float, granted: Granted) -> str:
        """Why the play must end now: its link is gone, an autopilot is armed, or may be; "": it may go on."""
        return self.lost or self._watch.stop_reason(time_s, granted)

    def advance(self, time_s: float) -> None:
        """Everything that is due by this time happens."""
        self._world.advance(time_s)
        self._world.datagrams()  # of sensors of a hull that nobody drives
        self._ask(time_s)
        motion = self._motion.motion(time_s)
        for said in self._sensors.due(time_s, motion, self._heard.system_id):
            self._datagrams.append((time_s, said))
            self._wire.put(time_s, said, Towards.AUTOPILOT)
        for passed in self._wire.due(time_s):
            self._send(passed.item)

    def sent_by_autopilot(self) -> list[CanFrame]:
        """Commands that it gives at its servo outputs, as frames; those on the bus it has sent itself."""
        sent, self._by_autopilot = self._by_autopilot, []
        return sent

    def sent_by_devices(self) -> list[CanFrame]:
        """Frames of the ESCs since this was last asked."""
        return self._world.sent_by_devices()

    def to_devices(self, frames: Sequence[CanFrame]) -> None:
        """Frames have come to the ESCs."""
        if self._source is CommandSource.UNKNOWN and any(self._side(one) is Towards.DEVICES for one in frames):
            self._source = CommandSource.BUS
        self._world.to_devices(frames)

    def datagrams(self) -> list[tuple[float, bytes]]:
        """MAVLink from the autopilot's side, with its times, since this was last asked."""
        datagrams, self._datagrams = self._datagrams, []
        return datagrams

    def to_autopilot(self, time_s: float, data: bytes) -> None:
        """MAVLink has come from the gateway: it is noted, and handed on."""
        self._listener.hear(time_s, data, self._heard.system_id)
        self._send(data)

    def truth(self) -> Truth:
        """Of thrusters and battery. How the vehicle really moved, nobody here knows: that is NaN."""
        truth = self._world.truth()
        unknown = truth.north_m * float("nan")
        moved = ("north_m", "east_m", "down_m", "yaw_rad", "through_water_mps", "over_ground_mps")
        return replace(truth, **dict.fromkeys(moved, unknown))

    def close(self) -> None:
        """There is nothing to let go of."""

    def _take(self, packet: Packet, time_s: float) -> None:
        self._heard.take(packet, time_s)
        if packet.component_id == AUTOPILOT_COMPONENT and packet.system_id == self._heard.system_id:
            self._motion.take(packet, time_s)
            self._answer(packet)
        readings = self._decoder.take(packet, time_s)
        self._news += readings
        commands = [one for one in readings if isinstance(one, ThrusterCommand)]
        if commands and self._takes_servo_outputs(time_s):
            self._by_autopilot += self._commands.frames(time_s, commands)

    def _takes_servo_outputs(self, time_s: float) -> bool:
        if self._source is CommandSource.UNKNOWN and time_s - self.start_s >= CHOICE_S:
            self._source = CommandSource.SERVO_OUTPUTS
        return self._source is CommandSource.SERVO_OUTPUTS

    def _answer(self, packet: Packet) -> None:
        """Of the autopilot to one of the gateway's commands."""
        if packet.message_id == formats.COMMAND_ACK.message_id:
            command, result, *_, component = formats.COMMAND_ACK.unpack(packet.payload)
            if component in (0, self._gateway_component):
                self._listener.answered(command, result)

    def _ask(self, time_s: float) -> None:
        """For the messages that are needed here."""
        news, self._news = self._news, []
        for request in self._requests.update(news, time_s, self._decoder.heard):
            if self._encoder is None:
                self._encoder = MavlinkEncoder(request.target_system, COMPONENT, self._signing)
            self._send(self._encoder.encode(request, time_s))


def _check(scenario: Scenario) -> None:
    for fault in scenario.faults:
        if fault.subject.target in HERE_ONLY:
            raise ValueError(f"{fault.words}: a real autopilot has a hull and water of its own; play it simulated")


@asynccontextmanager
async def attached(
    scenario: Scenario, profile: Profile, clock: Clock, endpoint: str, key: bytes | None = None
) -> AsyncIterator[AttachedDevices]:
    """Devices around the autopilot at an endpoint, until the end.

    Args:
        scenario, profile, key: as of `AttachedDevices`.
        clock: stamps what comes; the play begins now.
        endpoint: where the autopilot is, as in the gateway's configuration.

    Raises:
        OSError: it does not open.
        ValueError: it cannot be read, or as of `AttachedDevices`.
    """
    come: list[AttachedDevices] = []

    def hear(data: bytes) -> None:
        for devices in come:
            devices.from_autopilot(clock.now(), data)

    def lose(reason: str) -> None:
        for devices in come:
            devices.lost = f"{endpoint}: {reason}"

    transport = await open_transport(parse_endpoint(endpoint), hear, lose, Counter())
    try:
        come.append(AttachedDevices(scenario, profile, clock.now(), transport.send, key))
        yield come[0]
    finally:
        transport.close()
