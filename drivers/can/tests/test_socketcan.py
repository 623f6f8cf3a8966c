"""The kernel's frames, byte by byte, as python-can builds them, through a real socket of the loopback."""

import socket
import struct
from collections import Counter
from pathlib import Path

import can
import numpy as np
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame, pack_filters
from hypothesis import given
from hypothesis import strategies as st

import drivers.can.socketcan as socketcan_module
from drivers.can.datagrams import DatagramReader, Datagrams
from drivers.can.frame import CanFilter, CanFrame
from drivers.can.packets import CONTROL_BYTES, FD_BYTES, frames_in, lost_before, packed, packed_filter, stamps_of
from drivers.can.socketcan import SocketCanPort, open_socket
from drivers.clock import Clock

FD_SIZES = [0, 8, 12, 16, 20, 24, 32, 48, 64]


def identifiers(extended):
    return st.integers(0, 0x1FFF_FFFF if extended else 0x7FF)


@st.composite
def frames(draw):
    extended, fd = draw(st.booleans()), draw(st.booleans())
    size = draw(st.sampled_from(FD_SIZES) if fd else st.integers(0, 8))
    data = draw(st.binary(min_size=size, max_size=size))
    return CanFrame(0.0, draw(identifiers(extended)), data, extended, fd)


def built(frame):
    return build_can_frame(
        can.Message(
            arbitration_id=frame.identifier,
            is_extended_id=frame.extended,
            is_fd=frame.fd,
            is_error_frame=frame.error,
            data=frame.data,
        )
    )


def datagrams(packets):
    data = np.zeros((len(packets), FD_BYTES), np.uint8)
    data[:] = 0xEE  # as earlier datagrams left it
    for row, packet in enumerate(packets):
        data[row, : len(packet)] = np.frombuffer(packet, np.uint8)
    none = np.zeros((len(packets), CONTROL_BYTES), np.uint8)
    sizes = np.array([len(packet) for packet in packets], dtype=np.int64)
    return Datagrams(data, sizes, none, np.zeros(len(packets), np.int64))


def read(packets):
    counters = Counter()
    block = frames_in(datagrams(packets), np.zeros(len(packets)), counters)
    return list(block.frames()), counters


@given(st.lists(frames(), max_size=6))
def test_frames_are_what_was_built(sent):
    assert read([built(frame) for frame in sent]) == (sent, {})


@given(frames())
def test_python_can_packs_a_frame_as_we_do(frame):
    assert packed(frame)[:5] == built(frame)[:5]
    assert packed(frame)[8:] == built(frame)[8:]


def test_an_error_frame_keeps_its_class():
    error = CanFrame(0.0, 0x40, bytes(8), extended=False, error=True)
    assert read([built(error)]) == ([error], {})


def test_what_a_frame_carries_behind_its_data_is_no_part_of_it():
    packet = struct.pack("=IB3x8s", 5, 2, b"abcdefgh")
    block = frames_in(datagrams([packet]), np.zeros(1), Counter())
    assert block.data.tolist() == [[97, 98, 0, 0, 0, 0, 0, 0]]


def test_remote_frames_and_what_is_no_frame_are_counted():
    remote = build_can_frame(can.Message(arbitration_id=0x40, is_remote_frame=True, dlc=3))
    good = CanFrame(0.0, 7, b"x")
    assert read([remote, built(good), b"", bytes(15), bytes(20), remote]) == (
        [good],
        {"remote frame": 2, "malformed frame": 3},
    )


@given(st.lists(st.binary(max_size=FD_BYTES), max_size=8))
def test_no_bytes_raise_and_each_datagram_is_a_frame_or_counted(packets):
    heard, counters = read(packets)
    assert len(heard) + counters.total() == len(packets)


@given(identifiers(True), identifiers(True), st.booleans())
def test_filters_are_those_of_python_can(identifier, mask, extended):
    limit = 0x1FFF_FFFF if extended else 0x7FF
    wanted = CanFilter(identifier & limit, mask & limit, extended)
    theirs = pack_filters([{"can_id": wanted.identifier, "can_mask": wanted.mask, "extended": extended}])
    ours = struct.unpack("=II", packed_filter(wanted))
    filtered, mask = struct.unpack("=II", theirs)
    assert (ours[0] & ours[1], ours[1]) == (filtered & mask, mask)


# Through a socket


@pytest.fixture
def pair():
    """A socket that reads, and one that sends to it."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as reading,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sending,
    ):
        reading.bind(("127.0.0.1", 0))
        sending.connect(reading.getsockname())
        yield reading, sending


@pytest.fixture
def counters():
    return Counter()


@pytest.fixture
def port(pair, counters):
    reading, _ = pair
    opened = SocketCanPort(reading, Clock(), counters)
    yield opened
    opened.close()


def numbered(count, start=0):
    return [CanFrame(0.0, start + number, number.to_bytes(4, "little")) for number in range(count)]


async def test_what_comes_is_read_whole_in_order_and_stamped_by_the_kernel(port, pair, counters):
    clock = Clock()
    sent, before_s = numbered(300), clock.now()
    for frame in sent:
        pair[1].send(packed(frame))
    after_s = clock.now()
    block = await port.receive()
    assert [(frame.identifier, frame.data) for frame in block.frames()] == [
        (one.identifier, one.data) for one in sent
    ]
    assert np.all(np.diff(block.time_s) >= 0.0)
    assert before_s - 0.002 <= block.time_s[0] <= block.time_s[-1] <= after_s + 0.002
    assert counters == {}


async def test_more_than_one_call_takes_is_taken_by_the_next(port, pair, monkeypatch):
    for frame in numbered(socketcan_module.BATCH_MAX + 10):
        pair[1].send(packed(frame))
    blocks = [await port.receive(), await port.receive()]
    assert [len(block) for block in blocks] == [socketcan_module.BATCH_MAX, 10]
    identifiers = np.concatenate([block.identifier for block in blocks])
    assert identifiers.tolist() == list(range(socketcan_module.BATCH_MAX + 10))


async def test_blocks_outlive_the_next_reading(port, pair):
    pair[1].send(packed(CanFrame(0.0, 1, b"first")))
    first = await port.receive()
    pair[1].send(packed(CanFrame(0.0, 2, b"next!")))
    await port.receive()
    assert [(frame.identifier, frame.data) for frame in first.frames()] == [(1, b"first")]


async def test_frames_that_found_no_room_are_counted(pair, counters, monkeypatch):
    monkeypatch.setattr(socketcan_module, "RECEIVE_BUFFER_BYTES", 4096)
    port = SocketCanPort(pair[0], Clock(), counters)
    for number in range(500):
        pair[1].send(packed(CanFrame(0.0, number, b"")))
    got = len(await port.receive())
    pair[1].send(packed(CanFrame(0.0, 0, b"")))  # the count of the lost comes with the next that was not
    got += len(await port.receive())
    assert 0 < counters["receive buffer overflow"] == 501 - got
    port.close()


def test_a_socket_that_fails_says_why(pair):
    reader = DatagramReader(pair[0], 16, CONTROL_BYTES, 4)
    pair[0].close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        reader.read()


def open_descriptors():
    return len(list(Path("/proc/self/fd").iterdir()))


def test_an_interface_that_is_not_there_is_said_and_leaves_nothing_open():
    before = open_descriptors()
    with pytest.raises(OSError):
        open_socket("nosuchcan9", [CanFilter(1, 1, extended=True)])
    assert open_descriptors() == before


def test_the_last_count_of_what_was_lost_is_the_one_that_counts():
    control = np.zeros((3, CONTROL_BYTES), np.uint8)
    stamp = struct.pack("@Liill", 32, socket.SOL_SOCKET, 35, 1_700_000_000, 500_000_000)
    for row, lost in ((0, 7), (1, 2**32 - 1)):
        control[row, : len(stamp) + 20] = np.frombuffer(stamp + struct.pack("@LiiI", 20, 1, 40, lost), np.uint8)
    control[2, : len(stamp)] = np.frombuffer(stamp, np.uint8)
    sizes = np.array([56, 56, 32])
    packets = Datagrams(np.zeros((3, FD_BYTES), np.uint8), np.full(3, 16), control, sizes)
    assert lost_before(packets) == 2**32 - 1
    assert stamps_of(packets).tolist() == [1_700_000_000.5] * 3
    assert lost_before(datagrams([bytes(16)])) is None
    assert np.isnan(stamps_of(datagrams([bytes(16)]))).all()


def test_a_reader_of_a_socket_that_does_not_block_finds_nothing(pair):
    assert len(DatagramReader(pair[0], 16, CONTROL_BYTES, 4).read()) == 0
