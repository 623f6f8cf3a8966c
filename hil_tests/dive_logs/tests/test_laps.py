"""Parts of a dive, once or over and over: times go on, and whoever receives it sees no seam."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import islice, pairwise

import pytest

from drivers.can.dronecan import (
    DroneCanDecoder,
    DroneCanThruster,
    EscStatus,
    NodeStatus,
    encode_esc_status,
    encode_node_status,
)
from drivers.can.dronecan.node_status import NODE_STATUS, unpack_node_status
from drivers.can.dronecan.transfer import MESSAGE_MASK
from drivers.can.frame import CanFrame
from drivers.mavlink import formats
from drivers.mavlink.frames import FrameScanner, Packet
from drivers.readings import ThrusterReport
from hil_tests.dive_logs.counting_on import CircularCounters
from hil_tests.dive_logs.laps import Laps, Part
from hil_tests.dive_logs.packet_bytes import packet_bytes
from hil_tests.dive_logs.pieces import OnBus, OnLink, Piece

BUS = frozenset({"can0"})


def attitudes(count: int = 50, first_s: float = 1000.0, period_s: float = 0.1) -> list[Piece]:
    """Every packet has its time since boot in it, which is that of the dive here."""
    return [
        OnLink(
            first_s + n * period_s,
            Packet(30, 1, 1, formats.ATTITUDE.payload.pack(round(1e3 * n * period_s) + 1, *[0.0] * 6), n % 256),
        )
        for n in range(count)
    ]


def esc_reports(seconds: int = 3, rate_hz: int = 20) -> list[Piece]:
    pieces: list[Piece] = []
    for n in range(seconds * rate_hz):
        time_s = n / rate_hz
        status = EscStatus(0, 16.0, 3.0, 300.0, 1000 + n, 50, 0)
        frames = encode_esc_status(status, 20, n, time_s=time_s)
        if n % rate_hz == 0:
            frames += encode_node_status(NodeStatus(100 + n // rate_hz), 20, n // rate_hz, time_s=time_s)
        pieces += [OnBus(time_s, frame, "can0") for frame in frames]
    return pieces


def times(laps: Laps, count: int) -> list[float]:
    return [piece.time_s for piece in islice(laps, count)]


def test_a_part_counts_from_its_own_beginning():
    pieces = list(Laps(attitudes(), Part(1.0, 2.0), False, BUS))
    assert [round(piece.time_s, 6) for piece in pieces] == [round(0.1 * n, 6) for n in range(10)]
    assert formats.ATTITUDE.unpack(pieces[0].packet.payload)[0] == 1001


def test_all_of_a_dive_comes_once_and_unchanged():
    dive = attitudes()
    assert [piece.packet for piece in Laps(dive, Part(), False, BUS)] == [piece.packet for piece in dive]


def test_laps_follow_each_other_in_step():
    laps = Laps(attitudes(50), Part(), True, BUS)
    shown = times(laps, 175)
    assert {round(after - before, 6) for before, after in pairwise(shown)} == {0.1}
    assert laps.laps == 4
    assert laps.lap_s == pytest.approx(5.0)


def test_a_lap_of_a_part_is_as_long_as_the_part_however_few_the_packets():
    laps = Laps(attitudes(50), Part(1.0, 2.05), True, BUS)
    shown = times(laps, 33)
    assert laps.lap_s == pytest.approx(1.05)
    assert shown[11] == pytest.approx(1.05)


def test_a_lap_of_one_packet_does_not_turn_into_a_flood():
    assert times(Laps(attitudes(1), Part(), True, BUS), 4) == pytest.approx([0.0, 1.0, 2.0, 3.0])


def test_nothing_in_a_part_is_told_with_the_part():
    with pytest.raises(ValueError, match="nothing was recorded from 60 s on, counted from the beginning of the dive"):
        next(iter(Laps(attitudes(50), Part(60.0), True, BUS)))


@pytest.mark.parametrize(
    ("from_s", "to_s", "words"), [(-1.0, 5.0, "from_s = -1.0: want 0"), (5.0, 5.0, "to_s = 5.0: want a time after")]
)
def test_a_part_that_is_none_is_refused(from_s, to_s, words):
    with pytest.raises(ValueError, match=words):
        Part(from_s, to_s)


def test_a_receiver_of_packets_sees_no_seam():
    scanner, boot_ms = FrameScanner([30], drops := Counter[str]()), []
    for piece in islice(Laps(attitudes(50), Part(), True, BUS), 160):
        (packet,) = scanner.feed(packet_bytes(piece.packet), piece.time_s)
        boot_ms.append(formats.ATTITUDE.unpack(packet.payload)[0])
    assert not drops
    assert boot_ms == [100 * n + 1 for n in range(160)]


def test_what_was_lost_when_it_was_recorded_stays_lost():
    dive = attitudes(50)
    del dive[20:23]
    scanner = FrameScanner([30], drops := Counter[str]())
    for piece in islice(Laps(dive, Part(), True, BUS), 2 * len(dive)):
        scanner.feed(packet_bytes(piece.packet), piece.time_s)
    assert drops == {"lost in transit": 6}


def test_a_receiver_of_transfers_sees_no_seam():
    decoder = DroneCanDecoder([DroneCanThruster(1, 0)])
    dive = esc_reports()
    uptimes_s, reports = [], 0
    for frame in stamped(islice(Laps(dive, Part(), True, BUS), 4 * len(dive))):
        if frame.identifier & MESSAGE_MASK == NODE_STATUS.key:
            uptimes_s.append(unpack_node_status(frame.data[:-1]).uptime_s)
        reports += sum(isinstance(reading, ThrusterReport) for reading in decoder.decode(frame))
    assert not decoder.drops
    assert reports == 4 * 60
    assert uptimes_s == list(range(100, 112))


def test_a_transfer_that_the_cut_goes_through_costs_itself_alone():
    """A part from the middle of a transfer on: in later laps its rest is not played at all."""
    dive = esc_reports()[1:]
    decoder = DroneCanDecoder([DroneCanThruster(1, 0)])
    reports = sum(
        isinstance(reading, ThrusterReport)
        for frame in stamped(islice(Laps(dive, Part(), True, BUS), 3 * len(dive) - 2))
        for reading in decoder.decode(frame)
    )
    assert reports == 3 * 59
    assert decoder.drops == {"missing start": 2}  # the two frames of it, once


def test_frames_of_a_bus_that_speaks_something_else_are_left_as_they_are():
    dive = [OnBus(0.01 * n, CanFrame(0.0, 0x123, bytes([n, 0xFF])), "vesc") for n in range(5)]
    shown = [piece.frame.data for piece in islice(Laps(dive, Part(), True, BUS), 10)]
    assert shown == [piece.frame.data for piece in dive] * 2


def test_a_dive_is_read_as_far_as_it_is_played():
    read = 0

    class Endless:
        def __iter__(self) -> Iterator[Piece]:
            nonlocal read
            for n in range(10**9):
                read = n
                yield attitudes(1, first_s=float(n))[0]

    assert times(Laps(Endless(), Part(), False, BUS), 10) == [float(n) for n in range(10)]
    assert read == 9


def test_counters_go_on_from_where_they_were():
    counters = CircularCounters(8)
    assert [counters.shown(("a",), n) for n in (5, 6, 7)] == [5, 6, 7]
    counters.begin_anew()
    assert [counters.shown(("a",), n) for n in (5, 7)] == [0, 2]


def stamped(pieces: Iterator[Piece]) -> Iterator[CanFrame]:
    for piece in pieces:
        frame = piece.frame
        yield CanFrame(piece.time_s, frame.identifier, frame.data)
