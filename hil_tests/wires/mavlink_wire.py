"""The MAVLink wire: what faults do to the packets between an autopilot and the gateway.

In this order: sensors' faults change or withhold messages, as if they had been sent so; then somebody may listen and
send of his own; then the link loses, delays and damages what is on it. Messages of sensors are changed whichever way
they pass: a DVL's driver speaks to the autopilot as well.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import inf

from gateway.config import Config
from hil_tests.rig.link_conditions import Line
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault
from hil_tests.wires.intruders import intruders
from hil_tests.wires.link_faults import NONE, Noise, trouble
from hil_tests.wires.mavlink.changed_stream import ChangedStream
from hil_tests.wires.mavlink.payload_faults import PayloadFaults
from hil_tests.wires.mavlink.sealing import Sealer
from hil_tests.wires.way import Passed, Towards

ENDS = (Towards.AUTOPILOT, Towards.GATEWAY)
# what the wire calls that which its line counts
_LINE_COUNTS = {"lost": "packets lost", "duplicated": "packets sent twice", "held back": "packets overtaken"}


class MavlinkWire:
    """A `Wire` of packets. Pure: it is told the time.

    Args:
        faults: those of other targets are left to others.
        start_s: from when the faults' times count, in unix seconds.
        seed: of all that is random.
        key: 32 bytes, of the link's signatures; None: signed packets cannot be changed, only withheld, which leaves
            gaps in their numbers.
        config: of the gateway: where it reads thrusters and depth. None: no thruster is read on this link.

    Attributes:
        counts: what faults have done, by cause.

    Raises:
        ValueError: a key that is none.
    """

    def __init__(
        self,
        faults: Sequence[Fault],
        start_s: float,
        seed: int = 0,
        key: bytes | None = None,
        config: Config | None = None,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self._start_s = start_s
        self._link_faults = [fault for fault in faults if fault.subject.target is Target.LINK]
        self._line: Line[Passed[bytes]] = Line(seed=seed)
        self._noise = Noise(seed)
        self._intruders = intruders(self._link_faults, start_s)
        self._streams = {
            towards: ChangedStream(PayloadFaults(faults, seed, config), Sealer(key), self.counts) for towards in ENDS
        }
        self._release_s = inf  # when a packet that has begun has waited for its rest for too long

    def put(self, time_s: float, item: bytes, towards: Towards) -> None:
        """A packet enters the wire: one datagram, or what came at once of a stream.

        Raises:
            ValueError: neither towards the autopilot nor towards the gateway.
        """
        if towards not in ENDS:
            raise ValueError(f"towards = {towards}: want {' or '.join(map(str, ENDS))}, the ends of a MAVLink link")
        self._catch_up(time_s)
        said = self._streams[towards].take(time_s, time_s - self._start_s, item)
        self._release_s = self._waits_until_s()
        if said or said is item:
            self._enter(time_s, Passed(said, towards))

    def due(self, time_s: float) -> list[Passed[bytes]]:
        """What has arrived by now, in order of arrival, with what faults have added."""
        self._catch_up(time_s)
        return self._line.due(time_s)

    def next_s(self) -> float:
        """When more is due without anything being put in; infinity: never."""
        return min(self._line.next_s(), self._intrusion_s(), self._release_s)

    def _catch_up(self, time_s: float) -> None:
        """What goes onto the link by now without anything being put in."""
        while min(self._intrusion_s(), self._release_s) <= time_s:
            if self._intrusion_s() <= self._release_s:
                self._intrude()
            else:
                self._release()

    def _intrusion_s(self) -> float:
        return min(intruder.next_s() for intruder in self._intruders) if self._intruders else inf

    def _intrude(self) -> None:
        """The next packet of others."""
        intruder = min(self._intruders, key=lambda one: one.next_s())
        self.counts[intruder.counted] += 1
        self._send(*intruder.take())

    def _release(self) -> None:
        """The beginning of a packet of which the rest has not come."""
        towards = min(ENDS, key=lambda end: self._streams[end].release_s)
        waiting, time_s = self._streams[towards], self._release_s
        self._enter(time_s, Passed(waiting.release(), towards))
        self._release_s = self._waits_until_s()

    def _waits_until_s(self) -> float:
        return min(self._streams[Towards.AUTOPILOT].release_s, self._streams[Towards.GATEWAY].release_s)

    def _enter(self, time_s: float, passed: Passed[bytes]) -> None:
        """Onto the link, where others may listen."""
        for intruder in self._intruders:
            intruder.hear(time_s, passed)
        self._send(time_s, passed)

    def _send(self, time_s: float, passed: Passed[bytes]) -> None:
        """Onto the line, as good or bad as it is now."""
        now = trouble(self._link_faults, time_s - self._start_s) if self._link_faults else NONE
        self._line.conditions = now.conditions
        if now is NONE:
            self._line.put(time_s, passed)
            return
        if now.cut:
            self.counts["packets cut off"] += 1
            return
        self._line.put(time_s, self._damaged(passed, now.damage))
        if self._noise.happens(now.garbage):
            self.counts["garbage sent"] += 1
            self._line.put(time_s, Passed(self._noise.garbage(), passed.towards))
        if now.conditions.latency_s:
            self.counts["packets delayed"] += 1
        for cause, words in _LINE_COUNTS.items():
            if count := self._line.counts[cause]:
                self.counts[words] = count

    def _damaged(self, passed: Passed[bytes], share: float) -> Passed[bytes]:
        if not self._noise.happens(share):
            return passed
        self.counts["packets damaged"] += 1
        return Passed(self._noise.damaged(passed.item), passed.towards)
