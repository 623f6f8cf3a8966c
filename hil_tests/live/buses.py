"""The two CAN buses of the live benchmark: vcan where the kernel has it, else UDP sockets of the loopback.

Over UDP go the same 16 bytes of `struct can_frame`. The gateway reads them with the code that reads SocketCAN; the
kernel stamps them in the same way, and lets only those through that are wanted, by a filter program (classic BPF) in
place of CAN_RAW_FILTER.
"""

from __future__ import annotations

import ctypes
import socket
import struct
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.can.frame import CanFilter
from drivers.can.interface import SOCKETCAN, PortOpener
from drivers.can.packets import SO_RXQ_OVFL, packed_filter
from drivers.can.port import CanPort
from drivers.can.socketcan import SocketCanPort
from drivers.clock import Clock
from gateway.config_sections import CanBus
from hil_tests.vcan.interface import has_vcan

HOST = "127.0.0.1"
VCAN = ("vcan0", "vcan1")

SO_ATTACH_FILTER = 26  # asm-generic/socket.h
UDP_HEADER_BYTES = 8
# linux/bpf_common.h: BPF_LD | BPF_W | BPF_ABS, BPF_ALU | BPF_AND | BPF_K, BPF_JMP | BPF_JEQ | BPF_K, BPF_RET | BPF_K
_LOAD, _AND, _JUMP_IF_EQUAL, _RETURN = 0x20, 0x54, 0x15, 0x06
_INSTRUCTION = struct.Struct("=HBBI")
_WHOLE = 0xFFFF


@dataclass(frozen=True, slots=True)
class Buses:
    """Where the frames go.

    Attributes:
        medium: in words.
        interface: of the gateway's configuration.
        channels: of the two buses: names of interfaces, or UDP ports.
    """

    medium: str
    interface: str
    channels: tuple[str, str]

    def sender(self, bus: int) -> socket.socket:
        """A socket that sends onto one of them what it is given: CAN frames as the kernel has them."""
        if self.interface == SOCKETCAN:
            opened = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
            opened.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, b"")
            opened.bind((self.channels[bus],))
            return opened
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        opened.connect((HOST, int(self.channels[bus])))
        return opened


def buses() -> Buses:
    """Those of this machine."""
    if all(map(has_vcan, VCAN)):
        return Buses(f"{VCAN[0]} and {VCAN[1]}", SOCKETCAN, VCAN)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as two,
    ):
        for probe in (one, two):
            probe.bind((HOST, 0))
        ports = (str(one.getsockname()[1]), str(two.getsockname()[1]))
    return Buses("UDP in place of SocketCAN (no vcan0 and vcan1 here)", "virtual", ports)


def udp_opener(bus: CanBus) -> PortOpener:
    """Opens the UDP port that is the channel of a bus."""

    def open_port(filters: Sequence[CanFilter], clock: Clock, counters: Counter[str]) -> CanPort:
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        opened.bind((HOST, int(bus.channel)))
        if filters:
            attach(opened, filters)
        port = SocketCanPort(opened, clock, counters)
        # of UDP, the kernel counts as lost what the filter stops, too
        opened.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 0)
        return port

    return open_port


def attach(opened: socket.socket, filters: Sequence[CanFilter]) -> None:
    """Let the kernel drop all datagrams of a UDP socket that are no wanted frames."""
    program = filter_program(filters)
    instructions = ctypes.create_string_buffer(program, len(program))
    count = len(program) // _INSTRUCTION.size
    opened.setsockopt(socket.SOL_SOCKET, SO_ATTACH_FILTER, struct.pack("@HP", count, ctypes.addressof(instructions)))


def filter_program(filters: Sequence[CanFilter]) -> bytes:
    """As instructions of classic BPF: the identifier of the frame behind the UDP header against each filter."""
    steps = []
    for number, wanted in enumerate(filters):
        identifier, mask = (_as_loaded(word) for word in struct.unpack("=II", packed_filter(wanted)))
        to_the_end = 3 * (len(filters) - number - 1) + 1  # over the filters after this one, and over the refusal
        steps += [
            (_LOAD, 0, 0, UDP_HEADER_BYTES),
            (_AND, 0, 0, mask),
            (_JUMP_IF_EQUAL, to_the_end, 0, identifier & mask),
        ]
    steps += [(_RETURN, 0, 0, 0), (_RETURN, 0, 0, _WHOLE)]
    return b"".join(_INSTRUCTION.pack(*step) for step in steps)


def _as_loaded(word: int) -> int:
    """A word of the machine's own order, as BPF loads it: the first byte is the highest."""
    return int.from_bytes(word.to_bytes(4, sys.byteorder), "big")
