"""A recorded dive in place of a simulated vehicle: what its autopilot and its ESCs sent, at the times of the play.

What was said to them then is gone, and what is said now changes nothing: the gateway's own packets of that dive are
left out, its commands of now are noted, and not answered.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path

from drivers.can.frame import CanFrame, checked_frame
from drivers.mavlink import formats
from drivers.mavlink.frames import Packet
from drivers.mavlink.signing import Signing, SigningKey
from gateway.config import Config
from hil_tests.dive_logs.laps import WHOLE, Laps, Part
from hil_tests.dive_logs.packet_bytes import packet_bytes
from hil_tests.dive_logs.pieces import OnBus, Piece
from hil_tests.dive_logs.reading import LoggedDive
from hil_tests.dive_logs.senders import Side, side_of
from hil_tests.playback.listening import HeardModes, Listener
from hil_tests.rig.notes import Notes
from hil_tests.rig.truth import ModeChange
from hil_tests.wires.way import Towards

OWN_PACKETS = "packets of the gateway that watched that dive"
ANSWERS_TO_IT = "answers to the gateway that watched that dive"


@dataclass(frozen=True, slots=True)
class DiveLogs:
    """Which logs are played, and how.

    Attributes:
        logs: each `[LINK=]PATH`, as `gateway replay` takes them.
        folder: what relative paths are relative to.
        part: of the dive.
        again: whether it begins anew at its end, for ever.
        offsets_s: by log, what is to be added to its times; left out: how its clock runs beside those of the other
            logs is found.
    """

    logs: tuple[str, ...]
    folder: Path = Path()
    part: Part = WHOLE
    again: bool = False
    offsets_s: Mapping[Path, float] = field(default_factory=dict)


class RecordedDive:
    """Steps through the logs of a dive; told the time, and never waits. In constant memory, however long they are.

    Args:
        dive: its logs.
        config: whose buses and link they are of.
        start_s: when the play begins, unix.
        key: 32 bytes, by which all packets are signed anew; None: none is.

    Attributes:
        left_out: packets that are not played, by cause.

    Raises:
        OSError: a log cannot be read.
        ValueError: a log is not of its kind or of no link of the configuration, or nothing is in that part.
    """

    def __init__(self, dive: DiveLogs, config: Config, start_s: float, key: bytes | None = None) -> None:
        self._logged = LoggedDive(dive.logs, config, dive.folder, dive.offsets_s)
        dronecan = frozenset(bus.name for bus in config.can if bus.protocol == "dronecan")
        self._laps = Laps(self._logged, dive.part, dive.again, dronecan)
        self._sides: dict[str, Side] = {bus.name: side_of(bus, config) for bus in config.can if not bus.forwarded}
        self._own_component = None if config.mavlink is None else config.mavlink.component_id
        self._start_s = start_s
        self._signing = None if key is None else Signing(SigningKey(key), start_s)
        self._frames: defaultdict[tuple[str, Towards], list[CanFrame]] = defaultdict(list)
        self._datagrams: list[tuple[float, bytes]] = []
        self._listener, self._heard = Listener(key), HeardModes()
        self.left_out: Counter[str] = Counter()
        self._pieces: Iterator[Piece] = iter(self._laps)
        self._next: Piece | None = next(self._pieces, None)

    @property
    def buses(self) -> list[str]:
        """Names of the buses that it may have frames of."""
        return list(self._sides)

    @property
    def notes(self) -> Notes:
        """What was said to it."""
        return self._listener.notes

    @property
    def modes(self) -> list[ModeChange]:
        """Of the recorded autopilot; one more with each change."""
        return self._heard.modes

    @property
    def laps(self) -> int:
        """How often it has begun."""
        return self._laps.laps

    @property
    def over(self) -> bool:
        """Whether nothing more comes."""
        return self._next is None

    def next_s(self) -> float:
        """When something is due again, unix; infinity: never."""
        return inf if self._next is None else self._start_s + self._next.time_s

    def advance(self, time_s: float) -> None:
        """All that was sent by this time of the play.

        Raises:
            OSError: a log cannot be read any more.
        """
        while self._next is not None and self._start_s + self._next.time_s <= time_s:
            self._send(self._next)
            self._next = next(self._pieces, None)

    def sent_by_autopilot(self, bus: str | None = None) -> list[CanFrame]:
        """Frames since this was last asked; of a bus by its name, None: of the configuration's first."""
        return self._sent(bus, Towards.DEVICES)

    def sent_by_devices(self, bus: str | None = None) -> list[CanFrame]:
        """Frames since this was last asked; of a bus by its name, None: of the configuration's first."""
        return self._sent(bus, Towards.AUTOPILOT)

    def to_devices(self, frames: Sequence[CanFrame]) -> None:
        """Nothing comes of it: they did what they did."""

    def datagrams(self) -> list[tuple[float, bytes]]:
        """Packets since this was last asked, each with its time."""
        datagrams, self._datagrams = self._datagrams, []
        return datagrams

    def to_autopilot(self, time_s: float, data: bytes) -> None:
        """It is noted, and not answered."""
        self._listener.hear(time_s, data, self._heard.system_id)

    def truth(self) -> None:
        """Nobody knows what really was."""
        return

    def damage(self) -> dict[str, list[str]]:
        """What was lost of the logs, by their paths."""
        return {str(path): report.lines() for path, report in self._logged.damage.items()}

    def close(self) -> None:
        """Read no further."""
        self._next, self._pieces = None, iter(())

    def _sent(self, bus: str | None, towards: Towards) -> list[CanFrame]:
        name = next(iter(self._sides), "") if bus is None else bus
        return self._frames.pop((name, towards), [])

    def _send(self, piece: Piece) -> None:
        time_s = self._start_s + piece.time_s
        if isinstance(piece, OnBus):
            frame = piece.frame
            stamped = checked_frame(time_s, frame.identifier, frame.data, frame.extended, frame.fd, frame.error)
            self._frames[piece.bus, self._sides[piece.bus](frame)].append(stamped)
        elif self._is_played(piece.packet):
            self._heard.take(piece.packet, time_s)
            data = packet_bytes(piece.packet)
            self._datagrams.append((time_s, data if self._signing is None else self._signing.sign(data, time_s)))

    def _is_played(self, packet: Packet) -> bool:
        cause = ""
        if packet.component_id == self._own_component and packet.system_id == self._heard.system_id:
            cause = OWN_PACKETS
        elif packet.message_id == formats.COMMAND_ACK.message_id:
            cause = ANSWERS_TO_IT if formats.COMMAND_ACK.unpack(packet.payload)[5] == self._own_component else ""
        if cause:
            self.left_out[cause] += 1
        return not cause
