"""What we write in the formats of others is read by others, and by ourselves."""

from pathlib import Path

import numpy as np
import pytest
from can.io import CanutilsLogReader
from pymavlink import mavutil

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.candump import read_candump
from drivers.logs.candump_writer import candump_line, candump_lines
from drivers.logs.damage import DamageReport
from drivers.logs.tlog import read_packets
from drivers.logs.tlog_writer import PacketCutter, tlog_record, tlog_records
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.messages import CommandLong, StatusText

START_S = 1_795_372_763.25
FRAMES = [
    CanFrame(START_S, 0x123, b"\x01\x02", extended=False),
    CanFrame(START_S + 0.1, 0x1234567, bytes(range(8))),
    CanFrame(START_S + 0.2, 0x7, b"", extended=True),
    CanFrame(START_S + 0.3, 0x7FF, bytes(range(48)), extended=False, fd=True),
    CanFrame(START_S + 0.4, 0x4, bytes(8), extended=False, error=True),
]
ENCODER = MavlinkEncoder(1, 192)
PACKETS = [
    ENCODER.encode(StatusText(2, f"T{number} entangled?"), START_S) if number % 2
    else ENCODER.encode(CommandLong(176, (1.0, 19.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1), START_S)
    for number in range(20)
]  # fmt: skip


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "dive.log"


def test_candump_as_we_read_it(log: Path):
    log.write_text("".join(candump_line("can0", one) for one in FRAMES))
    damage = DamageReport()
    read = [one for _, block in read_candump(log, damage) for one in block.frames()]
    assert [one.data for one in read] == [one.data for one in FRAMES]
    assert [one.identifier for one in read] == [one.identifier for one in FRAMES]
    assert [(one.fd, one.error) for one in read] == [(one.fd, one.error) for one in FRAMES]
    assert np.allclose([one.time_s for one in read], [one.time_s for one in FRAMES], rtol=0.0, atol=1e-6)
    assert not damage.lost


def test_candump_as_python_can_reads_it(log: Path):
    log.write_text("".join(candump_line("can0", one) for one in FRAMES))
    with CanutilsLogReader(log) as reader:
        read = list(reader)
    assert [(one.arbitration_id, bytes(one.data), one.channel) for one in read[:4]] == [
        (one.identifier, one.data, "can0") for one in FRAMES[:4]
    ]


def test_a_block_gives_the_same_lines():
    assert list(candump_lines("can1", FrameBlock.of(FRAMES))) == [candump_line("can1", one) for one in FRAMES]


def test_tlog_as_we_read_it(log: Path):
    log.write_bytes(b"".join(tlog_record(START_S + number, one) for number, one in enumerate(PACKETS)))
    damage = DamageReport()
    read = [one for batch in read_packets(log, damage) for one in batch]
    assert [time_s for time_s, _ in read] == [START_S + number for number in range(20)]
    assert not damage.lost


def test_tlog_as_pymavlink_reads_it(log: Path):
    log = log.with_suffix(".tlog")  # by which it knows that there are times
    log.write_bytes(b"".join(tlog_record(START_S, one) for one in PACKETS))
    reader = mavutil.mavlink_connection(str(log))
    try:
        texts = [message.text for message in iter(lambda: reader.recv_match(type="STATUSTEXT"), None)]
    finally:
        reader.close()
    assert texts == [f"T{number} entangled?" for number in range(1, 20, 2)]


def test_several_packets_of_one_datagram():
    assert list(tlog_records(START_S, PACKETS[0] + PACKETS[1])) == [
        tlog_record(START_S, PACKETS[0]),
        tlog_record(START_S, PACKETS[1]),
    ]
    assert list(tlog_records(START_S, b"noise")) == [tlog_record(START_S, b"noise")]


@pytest.mark.parametrize("size", [1, 7, 40, 1000])
def test_a_stream_cut_anywhere(size: int):
    stream = b"".join(PACKETS)
    cutter = PacketCutter()
    pieces = [stream[start : start + size] for start in range(0, len(stream), size)]
    assert [packet for piece in pieces for packet in cutter.cut(piece)] == PACKETS
    assert cutter.outside == 0


def test_noise_between_packets_is_counted():
    noise = b"\xfd\x00noise\xfe"
    cutter = PacketCutter()
    found = [packet for one in PACKETS for packet in cutter.cut(noise + one)]
    assert found + cutter.rest() == PACKETS
    assert cutter.outside == len(noise) * len(PACKETS)
