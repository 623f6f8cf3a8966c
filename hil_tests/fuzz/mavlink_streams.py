"""MAVLink: streams of bytes, signed and not, messages of any content, and the CAN frames in them."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.mavlink.can_forward import CanForward
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.forwarded_frames import ForwardedFrames
from drivers.mavlink.frames import FrameScanner
from drivers.mavlink.signing import KEY_SIZE, Signing, SigningKey
from drivers.readings import Reading
from hil_tests.fuzz.frame_bytes import STEPS_S
from hil_tests.fuzz.mavlink_bytes import (
    TOKENS,
    contents,
    everything_decoder,
    framed,
    message_ids,
    packets,
    signed_packets,
)
from hil_tests.fuzz.target import Target, require

START_S = 1_700_000_000.0
FRAME_MAX = 280  # bytes of the longest frame of MAVLink 2
_KEY = bytes(range(KEY_SIZE))
_UNCERTAIN = "unknown message"  # where a stream pauses, it is believed that one ends there


def mavlink_targets() -> list[Target]:
    """Of the link."""
    return [
        Target("mavlink", "a stream of MAVLink, cut anywhere", _read_stream, _streams, TOKENS),
        Target("mavlink_signed", "a stream of signed MAVLink", _read_signed, _signed, TOKENS),
        Target("mavlink_messages", "messages of any content, CAN frames among them", _read_messages, _contents),
    ]


def _read_stream(data: bytes) -> None:
    """Cut anywhere it gives the same readings, and never more than a frame is kept."""
    whole, parts = everything_decoder(), everything_decoder()
    readings = _taken(whole, data, [len(data)])
    in_parts = _taken(parts, data, _cuts(data))
    if _UNCERTAIN not in whole.drops + parts.drops:
        require(in_parts == readings, f"in parts {in_parts}, whole {readings}")
    scanner = FrameScanner(message_ids(), Counter())
    for begin, end in pairwise([0, *_cuts(data)]):
        scanner.feed(data[begin:end], START_S)
        require(scanner.pending <= FRAME_MAX, f"{scanner.pending} bytes are kept")


def _taken(decoder: MavlinkDecoder, data: bytes, cuts: list[int]) -> list[Reading]:
    return [one for begin, end in pairwise([0, *cuts]) for one in decoder.decode(data[begin:end], START_S)]


def _cuts(data: bytes) -> list[int]:
    """Where parts end: the bytes themselves say it."""
    cuts, place = [], 0
    while place < len(data):
        place = min(place + 1 + data[place] % 97, len(data))
        cuts.append(place)
    return cuts or [0]


def _read_signed(data: bytes) -> None:
    gate = Signing(SigningKey(_KEY), START_S)
    decoder = everything_decoder(gate)
    for number, (begin, end) in enumerate(pairwise([0, *_cuts(data)])):
        decoder.decode(data[begin:end], START_S + number)
    gate.history(START_S)
    decoder.answers()


def _read_messages(data: bytes) -> None:
    """All that comes of them is valid, and the CAN frames are ones that another decoder can take."""
    drops: Counter[str] = Counter()
    forwarded, bus = ForwardedFrames(drops), CanForward("can1", 1, None)
    decoder, esc = everything_decoder(can_frames=forwarded), DroneCanDecoder([DroneCanThruster(1, 0)])
    time_s = START_S
    for step, packet in framed(data):
        time_s += STEPS_S[step % len(STEPS_S)]
        bus.update(decoder.decode(packet, time_s), time_s)
        for frame in bus.frames(forwarded.take()):
            esc.decode(frame)
        bus.state(time_s)
        decoder.answers()
    bus.stop(time_s)


def _streams() -> list[bytes]:
    every = packets()
    return [b"".join(every), b"".join(every[:5]), b"".join(every[2:9]), b"".join(every[-4:])]


def _signed() -> list[bytes]:
    signed = signed_packets(_KEY)
    return [b"".join(signed), b"".join([signed[0], *signed]), b"".join([*signed, *packets()[:3]])]


def _contents() -> list[bytes]:
    return [contents()]
