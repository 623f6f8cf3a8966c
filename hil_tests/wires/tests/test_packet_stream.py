"""Cutting a stream into packets: whatever the cuts and the garbage, no byte is lost, added or out of place."""

from __future__ import annotations

from itertools import pairwise
from math import inf

from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.frames import PATIENCE_S
from drivers.mavlink.tests.peer import Peer
from hil_tests.wires.mavlink.packet_stream import PacketStream

UNKNOWN = b"\xfd\x03\x00\x00\x05\x01\x01\x99\x99\x99abc\x12\x34"  # a message that no dialect knows


def never(_frame):
    return False


def always(_frame):
    return True


def telemetry(count):
    peer = Peer()
    return [peer.heartbeat(custom_mode=n, mavlink1=n % 3 == 0) for n in range(count)]


def cut(data, places):
    """The data in pieces, cut at these places."""
    edges = [0, *sorted(place % (len(data) + 1) for place in places), len(data)]
    return [data[start:end] for start, end in pairwise(edges)]


def pieces(stream, cuts, holds=never):
    return [stretch for n, piece in enumerate(cuts) for stretch in stream.feed(piece, 0.01 * n, holds)]


@given(
    st.lists(st.one_of(st.sampled_from([*telemetry(6), UNKNOWN]), st.binary(max_size=30)), max_size=12),
    st.lists(st.integers(0, 10_000), max_size=10),
    st.booleans(),
)
def test_no_byte_is_lost_or_out_of_place(parts, places, hold):
    data, stream = b"".join(parts), PacketStream()
    stretches = pieces(stream, cut(data, places), always if hold else never)
    assert b"".join(stretch.data for stretch in stretches) + stream.release() == data


@given(st.lists(st.integers(0, 10_000), max_size=30), st.booleans())
def test_every_packet_of_a_clean_stream_is_found_wherever_it_is_cut(places, hold):
    packets = [*telemetry(5), UNKNOWN, *telemetry(5)]
    stretches = pieces(PacketStream(), cut(b"".join(packets), places), always if hold else never)
    assert [stretch.packet for stretch in stretches if stretch.packet is not None] == packets
    assert not hold or all(stretch.whole for stretch in stretches if stretch.packet is not None)


def test_packets_between_garbage_are_found():
    one, two, three = telemetry(3)
    data = b"\xfdgarbage" + one + b"\x00\xfe\xfd\xfd" + two + b"\x00" + three
    found = [stretch.packet for stretch in PacketStream().feed(data, 0.0, never)]
    assert [packet for packet in found if packet is not None] == [one, two, three]


def test_a_damaged_packet_is_passed_as_it_is():
    one, two = telemetry(2)
    damaged = one[:-1] + bytes((one[-1] ^ 1,))
    stretches = PacketStream().feed(damaged + two, 0.0, always)
    assert b"".join(stretch.data for stretch in stretches) == damaged + two
    assert [stretch.packet for stretch in stretches if stretch.packet is not None] == [two]


def test_bytes_of_no_interest_are_passed_at_once():
    [packet], stream = telemetry(1), PacketStream()
    assert [stretch.data for stretch in stream.feed(packet[:5], 0.0, never)] == [packet[:5]]
    assert not stream.holding
    [rest] = stream.feed(packet[5:], 0.0, never)
    assert (rest.data, rest.packet, rest.whole) == (packet[5:], packet, False)


def test_what_waits_in_vain_is_released():
    one, two = telemetry(2)
    stream = PacketStream()
    assert b"".join(stretch.data for stretch in stream.feed(one[:9], 1.0, always)) == b""
    assert stream.release_s == 1.0 + PATIENCE_S
    assert stream.release() == one[:9]
    assert stream.release_s == inf
    later = stream.feed(two, 2.0, always)
    assert [stretch.packet for stretch in later if stretch.packet is not None] == [two]
    assert b"".join(stretch.data for stretch in later) == two


def test_a_packet_that_is_one_datagram_stays_the_same_object():
    [packet] = telemetry(1)
    [stretch] = PacketStream().feed(packet, 0.0, always)
    assert stretch.data is packet
