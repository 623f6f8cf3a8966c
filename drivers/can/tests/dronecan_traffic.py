"""Traffic of a DroneCAN bus as hypothesis draws it: what nodes send, and what becomes of it on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from hypothesis import strategies as st

from drivers.bus_readings import Health, NodeMode
from drivers.can.dronecan import (
    EscStatus,
    EscStatusExtended,
    NodeStatus,
    encode_esc_status,
    encode_node_status,
    encode_raw_command,
    encode_rpm_command,
    encode_status_extended,
)
from drivers.can.frame import CanFrame

halves = st.sampled_from([16.0, 0.0, -2.5, float("nan"), float("inf"), float("-inf")])
speeds_rpm = st.sampled_from([0, 900, -900, 29_999, 30_001, 65_535, -131_072])
indices = st.sampled_from([0, 1, 2, 9])

statuses = st.builds(EscStatus, st.integers(0, 9), halves, halves, halves, speeds_rpm, st.integers(0, 127), indices)
extended = st.builds(
    EscStatusExtended, *[st.integers(0, 100)] * 2, st.integers(-20, 90), st.just(5), st.integers(0, 1), indices
)
node_statuses = st.builds(NodeStatus, st.integers(0, 12), st.sampled_from(Health), st.sampled_from(NodeMode))


def numbers(largest: int) -> st.SearchStrategy[list[int]]:
    return st.one_of(
        st.lists(st.integers(-largest - 1, largest), min_size=1, max_size=8),
        st.lists(st.just(0), max_size=8),
        st.lists(st.integers(-largest - 1, largest), min_size=15, max_size=20),
    )


Encode = Callable[[object, int, int], list[CanFrame]]

messages: st.SearchStrategy[tuple[Encode, object]] = st.one_of(
    st.tuples(st.just(encode_esc_status), statuses),
    st.tuples(st.just(encode_esc_status), statuses),
    st.tuples(st.just(encode_raw_command), numbers(8191)),
    st.tuples(st.just(encode_rpm_command), numbers(131_071)),
    st.tuples(st.just(encode_status_extended), extended),
    st.tuples(st.just(encode_node_status), node_statuses),
)
steps_s = st.sampled_from([0.0, 0.001, 0.02, 0.02, 0.02, 0.5, 1.0, 2.5, 3.5, -0.5])


@st.composite
def transfers(draw: st.DrawFn) -> list[CanFrame]:
    """Messages of a few nodes, their frames interleaved; each node counts its messages of a type, mostly."""
    counts: dict[tuple[object, int], int] = {}
    waiting: list[list[CanFrame]] = []
    for encode, value in draw(st.lists(messages, min_size=1, max_size=25)):
        node = draw(st.sampled_from([10, 11, 12]))
        counts[encode, node] = counts.get((encode, node), -1) + draw(st.sampled_from([1, 1, 1, 1, 0, 2]))
        waiting.append(encode(value, node, counts[encode, node]))
    frames: list[CanFrame] = []
    at_once = draw(st.integers(1, 3))
    while waiting:
        chosen = waiting[draw(st.integers(0, min(at_once, len(waiting)) - 1))]
        frames.append(chosen.pop(0))
        waiting = [one for one in waiting if one]
    return frames


def _corrupted(frame: CanFrame, bit: int) -> CanFrame:
    data = bytearray(frame.data)
    data[bit // 8 % len(data)] ^= 1 << bit % 8
    return replace(frame, data=bytes(data))


@st.composite
def traffic(draw: st.DrawFn) -> list[CanFrame]:
    """Frames as they arrive: some lost, repeated, out of order, damaged, foreign, of another kind or cut short."""
    frames = draw(transfers())
    for _ in range(draw(st.integers(0, 5))):
        place, bit = draw(st.integers(0, len(frames) - 1)), draw(st.integers(0, 63))
        frame = frames[place]
        match draw(st.integers(0, 8)):
            case 0 if len(frames) > 1:
                del frames[place]
            case 1:
                frames.insert(place, frame)
            case 2:
                frames.insert(bit % len(frames), frame)
            case 3 if frame.data:
                frames[place] = _corrupted(frame, bit)
            case 4:
                frames[place] = replace(frame, data=frame.data[: bit % 8])
            case 5:
                frames[place] = replace(frame, data=frame.data[:8] + bytes(40), fd=True)
            case 6:
                frames[place] = replace(frame, error=True)
            case 7:
                frames[place] = replace(frame, identifier=frame.identifier & ~0x7F)
            case 8:
                frames[place] = replace(frame, identifier=0x123, extended=False)
    time_s, timed = 100.0, []
    for frame in frames:
        time_s += draw(steps_s)
        timed.append(replace(frame, time_s=time_s))
    return timed
