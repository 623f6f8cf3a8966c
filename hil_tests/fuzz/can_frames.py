"""Frames of CAN buses: what Linux gives of them, and every decoder, of single frames and of blocks."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import dronecan
import numpy as np
from dronecan.transport import Transfer

from drivers.can.decoder import CanDecoder
from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.dronecan.esc_status import ESC_STATUS, STATUS_EXTENDED
from drivers.can.dronecan.node_status import NODE_STATUS
from drivers.can.dronecan.setpoints import RAW_COMMAND, RPM_COMMAND
from drivers.can.dronecan.transfer import NODE_ID_MAX, split
from drivers.can.error_frame import condition
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.load import BitRates, BusLoadMeter
from drivers.can.packets import CLASSIC_BYTES, CONTROL_BYTES, FD_BYTES, frames_in, lost_before, stamps_of
from drivers.can.vesc import VescDecoder, VescThruster
from drivers.can.vesc_messages import Packet, identifier
from drivers.command import CommandScale
from drivers.readings import Reading
from hil_tests.fuzz.frame_bytes import START_S, STEPS_S, block_of, bytes_of, datagrams
from hil_tests.fuzz.target import Target, require
from hil_tests.fuzz.vendor import vendor_decoder, vendor_frames

_NODES = (10, 11, 12)
_TYPES = (ESC_STATUS, RAW_COMMAND.data_type, RPM_COMMAND.data_type, STATUS_EXTENDED, NODE_STATUS)
_TRANSFER = struct.Struct("<BBBBB")  # type, node, transfer id, step in time, bytes of payload
_PACKET = struct.Struct("<BB")  # bytes of a packet, bytes of its control data

MakeDecoder = Callable[[], CanDecoder]


def can_frame_targets() -> list[Target]:
    """One of the kernel's packets, one of each decoder."""
    return [
        Target("socketcan", "packets of a SocketCAN socket and their control data", _read_packets, _packet_seeds),
        Target("dronecan", "frames of a DroneCAN bus, alone and in blocks", _checked(_dronecan), _dronecan_seeds),
        Target("dronecan_transfers", "whole DroneCAN transfers of any payload", _read_transfers, _transfer_seeds),
        Target("vesc", "frames of VESCs, alone and in blocks", _checked(_vesc), _vesc_seeds),
        Target("dbc", "vendor frames by a database, alone and in blocks", _checked(vendor_decoder), vendor_frames),
    ]


def check_decoder(make: MakeDecoder, block: FrameBlock, cut: int) -> None:
    """Frames one by one, in two blocks, and some alone between the blocks, give the same.

    Args:
        make: a decoder.
        block: the frames.
        cut: where the blocks part.

    Raises:
        AssertionError: they do not.
    """
    alone = make()
    expected = [reading for frame in block.frames() for reading in alone.decode(frame)]
    _require_same("blocks", alone, expected, *_in_blocks(make(), block, cut, singles=0))
    _require_same("blocks and frames by turns", alone, expected, *_in_blocks(make(), block, cut, singles=2))


def _in_blocks(decoder: CanDecoder, block: FrameBlock, cut: int, singles: int) -> tuple[CanDecoder, list[Reading]]:
    between = cut + singles
    readings = decoder.decode_block(block.part(slice(cut))).readings()
    readings += [reading for frame in block.part(slice(cut, between)).frames() for reading in decoder.decode(frame)]
    return decoder, readings + decoder.decode_block(block.part(slice(between, None))).readings()


def _require_same(
    how: str, alone: CanDecoder, expected: list[Reading], decoder: CanDecoder, readings: list[Reading]
) -> None:
    require(readings == expected, f"{how}: readings {readings}, one by one {expected}")
    require(decoder.drops == alone.drops, f"{how}: drops {decoder.drops}, one by one {alone.drops}")


def _checked(make: MakeDecoder) -> Callable[[bytes], None]:
    def check(data: bytes) -> None:
        block = block_of(data[1:])
        check_decoder(make, block, data[0] % (len(block) + 1) if data else 0)

    return check


def _read_packets(data: bytes) -> None:
    """All frames are ones that could be, and each packet is a frame or counted."""
    packets = datagrams(*_packets(data))
    counters: Counter[str] = Counter()
    stamps_of(packets)
    lost_before(packets)
    block = frames_in(packets, np.arange(len(packets), dtype=np.float64), counters)
    frames = [CanFrame(f.time_s, f.identifier, f.data, f.extended, f.fd, f.error) for f in block.frames()]
    require(len(frames) + counters.total() == len(packets), f"{len(frames)} frames and {counters} of {len(packets)}")
    for frame in frames:
        condition(frame)
    meter = BusLoadMeter(BitRates(500_000))
    meter.read(block)
    meter.share(len(packets) + 1.0)


def _packets(data: bytes) -> tuple[list[bytes], list[bytes]]:
    packets, control, place = [], [], 0
    while place + _PACKET.size <= len(data):
        size, control_size = _PACKET.unpack_from(data, place)
        begin = place + _PACKET.size
        packets.append(data[begin : begin + size])
        control.append(data[begin + size : begin + size + control_size])
        place = begin + size + control_size
    return packets, control


def _packet_seeds() -> list[bytes]:
    stamp = struct.pack("@Lii2l", 32, 1, 35, 1_700_000_000, 5) + struct.pack("@LiiI4x", 20, 1, 40, 3)
    classic = struct.pack("=IB3x8s", 0x8000_0123, 8, bytes(range(8)))
    flexible = struct.pack("=IB3x64s", 0x123, 64, bytes(range(64)))
    error = struct.pack("=IB3x8s", 0x2000_0044, 8, b"\0\x08")
    remote = struct.pack("=IB3x8s", 0x4000_0123, 0, b"")
    packets = [(one, stamp) for one in (classic, flexible, error, remote, classic)]
    require(all(len(one) in (CLASSIC_BYTES, FD_BYTES) for one, _ in packets), "seeds are packets")
    require(len(stamp) <= CONTROL_BYTES, "seeds have control data")
    return [b"".join(_PACKET.pack(len(one), len(control)) + one + control for one, control in packets)]


def _dronecan() -> CanDecoder:
    return DroneCanDecoder(
        [
            DroneCanThruster(1, 0),
            DroneCanThruster(2, 1, bidirectional_command=False, reverse=True),
            DroneCanThruster(3, 2, maximum_rpm=3000.0, node_id=12),
            DroneCanThruster(4, 9, signed=False),
        ]
    )


def _dronecan_seeds() -> list[bytes]:
    """Half a second of a bus as the `dronecan` package writes it."""
    frames = [frame for number in range(6) for frame in _dronecan_traffic(number)]
    return [b"\0" + bytes_of(frames), b"\x07" + bytes_of(frames[:12]), b"\x01" + bytes_of(frames[-5:])]


def _dronecan_traffic(number: int) -> Iterator[CanFrame]:
    esc = dronecan.uavcan.equipment.esc
    yield from _sent(_NODES[0], number, esc.RawCommand(cmd=[100 * number, -200, 300, 0, 5, 6, 7, 8, 9, 10]))
    yield from _sent(_NODES[0], number, esc.RPMCommand(rpm=[1000, -1000, 50]))
    for node in _NODES[1:]:
        status = esc.Status(error_count=1, voltage=16.0, current=3.0, temperature=310.0, rpm=900, esc_index=node - 11)
        yield from _sent(node, number, status)
        yield from _sent(node, number, dronecan.uavcan.protocol.NodeStatus(uptime_sec=number, health=number % 4))


def _sent(node: int, transfer_id: int, message: object) -> Iterator[CanFrame]:
    for frame in Transfer(transfer_id, node, payload=message, transfer_priority=16).to_frames():
        yield CanFrame(0.0, frame.message_id, bytes(frame.bytes))


def _read_transfers(data: bytes) -> None:
    """Right checksums around any payload."""
    frames, place, time_s = [], 1, START_S
    while place + _TRANSFER.size <= len(data):
        kind, node, transfer_id, step, size = _TRANSFER.unpack_from(data, place)
        begin = place + _TRANSFER.size
        place = begin + size
        time_s += STEPS_S[step % len(STEPS_S)]
        frames += split(
            _TYPES[kind % len(_TYPES)],
            data[begin:place],
            source_node=1 + node % NODE_ID_MAX,
            transfer_id=transfer_id,
            priority=16,
            time_s=time_s,
        )
    check_decoder(_dronecan, FrameBlock.of(frames), data[0] % (len(frames) + 1) if data else 0)


def _transfer_seeds() -> list[bytes]:
    payloads: Sequence[tuple[int, int, bytes]] = (
        (0, 10, struct.pack("<IeeeHB", 3, 16.0, 2.5, 300.0, 900, 0)[:13] + b"\0"),
        (0, 11, struct.pack("<Ieee", 3, np.nan, np.inf, 300.0) + b"\x84\x03\x00\x28"),
        (1, 9, bytes(range(14))),
        (2, 9, bytes(range(9))),
        (3, 10, b"\x10\x20\x30\x40\x50\x60\x70"),
        (4, 10, struct.pack("<IBH", 12, 0x40, 7)),
    )
    whole = [
        _TRANSFER.pack(kind, node, number, 3, len(one)) + one for number, (kind, node, one) in enumerate(payloads)
    ]
    return [b"\0" + b"".join(whole), b"\x09" + b"".join(2 * whole)]


def _vesc() -> CanDecoder:
    return VescDecoder(
        [
            VescThruster(2, 7, "duty", CommandScale(-0.95, 0.0, 0.95, dead_band=0.01), pole_pairs=7),
            VescThruster(1, 8, "rpm", CommandScale(-20000.0, 0.0, 30000.0, reverse=True), 7, signed=False),
            VescThruster(3, 9, pole_pairs=1, reverse=True),
            VescThruster(4, 10, "current", CommandScale(-30.0, 0.0, 30.0)),
        ]
    )


def _vesc_seeds() -> list[bytes]:
    frames = [
        CanFrame(0.0, identifier(packet, controller), struct.pack(">ihh", 9000, 25, 160))
        for packet in Packet
        for controller in (7, 8, 9, 10)
    ]
    return [b"\x05" + bytes_of(frames[first::7]) for first in range(7)]
