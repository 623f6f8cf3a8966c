"""Blocks of frames: what numpy makes of them is what the decoder makes of them one by one."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.bus_readings import BabblingNode
from drivers.can.dronecan import (
    DroneCanDecoder,
    DroneCanThruster,
    EscStatus,
    NodeStatus,
    encode_esc_status,
    encode_node_status,
    encode_raw_command,
)
from drivers.can.dronecan.esc_status import ESC_STATUS
from drivers.can.dronecan.rates import FRAMES_PER_S_MAX, FrameRates
from drivers.can.dronecan.transfer_block import crc
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.tests.dronecan_traffic import traffic
from drivers.reading_block import ReadingBlock

WIRED = [
    DroneCanThruster(3, 0, reverse=True),
    DroneCanThruster(1, 1, bidirectional_command=False, signed=False, node_id=11),
    DroneCanThruster(2, 2, maximum_rpm=3000.0),
]


def one_by_one(decoder, frames):
    return [reading for frame in frames for reading in decoder.decode(frame)]


@given(traffic(), st.data())
@settings(max_examples=80, deadline=None)
def test_blocks_give_what_single_frames_give(frames, data):
    expected, decoder, readings = DroneCanDecoder(WIRED), DroneCanDecoder(WIRED), []
    cuts = sorted(data.draw(st.lists(st.integers(0, len(frames)), max_size=4)))
    for begin, end in zip([0, *cuts], [*cuts, len(frames)], strict=True):
        part = frames[begin:end]
        if data.draw(st.integers(0, 3)):
            readings += decoder.decode_block(FrameBlock.of(part)).readings()
        else:
            readings += one_by_one(decoder, part)
    assert repr(readings) == repr(one_by_one(expected, frames))
    assert decoder.drops == expected.drops


def dive(seconds: float, losses: int = 0) -> list[CanFrame]:
    """Three ESCs at 50 Hz and their commander; a few frames are lost."""
    frames = []
    for n in range(round(50 * seconds)):
        time_s = 1000.0 + 0.02 * n
        frames += encode_raw_command([n % 8000, -n % 8000, 5], 10, n, time_s=time_s)
        for index in range(3):
            status = EscStatus(n, 16.0 + index, 2.0, 300.0, 30 * n % 3000, 50, index)
            frames += encode_esc_status(status, 11 + index, n, time_s=time_s + 0.001 * (1 + index))
    chance = random.Random(1)
    for _ in range(losses):
        del frames[chance.randrange(len(frames))]
    return frames


def worn(frames: list[CanFrame], chance: random.Random) -> list[CanFrame]:
    """What is left of mostly regular traffic on a bus with bad contacts and a recorder with a bad clock."""
    arrived, shift_s = [], 0.0
    for frame in frames:
        data = bytearray(frame.data)
        match chance.randrange(90):
            case 0:
                continue
            case 1 if arrived:
                arrived.append(chance.choice(arrived[-12:]))
            case 2 if arrived:
                arrived.insert(-1, frame)
                continue
            case 3:
                data[min(3, len(data) - 2)] ^= 4
            case 4:
                shift_s += chance.choice([-0.3, 0.9, 2.1, 3.2, -2.5, 1.99])
            case 5:  # the message after it seems to be its repetition
                data[-1] = data[-1] + 1 & 0x1F | data[-1] & 0xE0
        arrived.append(replace(frame, data=bytes(data), time_s=frame.time_s + shift_s))
    return arrived


def regular(chance: random.Random) -> list[CanFrame]:
    """Two ESCs and a commander, now with one message in a frame, now with several; some count badly."""
    frames: list[CanFrame] = []
    width, counted = chance.choice([1, 4, 9]), chance.choice([1, 1, 1, 32])
    for n in range(60):
        time_s = 50.0 + 0.02 * n
        number = 0 if n % 7 == 3 and counted > 1 else n
        frames += encode_raw_command([chance.choice([0, 100, -8000])] * width, 10, n // 3, time_s=time_s)
        status = EscStatus(n, 16.0, 2.0, 300.0, 30 * n, 50, n % 3)
        pair = [encode_esc_status(status, node, number, time_s=time_s) for node in (11, 12)]
        frames += [frame for two in zip(*pair, strict=True) for frame in two]
        frames += encode_node_status(NodeStatus(n // 50), 11 + n % 2, n // 2, time_s=time_s)
    return frames


@pytest.mark.parametrize("seed", range(40))
def test_mostly_regular_traffic_in_blocks_is_that_frame_by_frame(seed):
    chance = random.Random(seed)
    frames = worn(regular(chance), chance)
    expected, decoder, readings = DroneCanDecoder(WIRED), DroneCanDecoder(WIRED), []
    cuts = sorted(chance.sample(range(len(frames)), chance.randrange(4)))
    for begin, end in zip([0, *cuts], [*cuts, len(frames)], strict=True):
        readings += decoder.decode_block(FrameBlock.of(frames[begin:end])).readings()
    assert repr(readings) == repr(one_by_one(expected, frames))
    assert decoder.drops == expected.drops


ESCS = [DroneCanThruster(index + 1, index) for index in range(3)]


@pytest.mark.parametrize("losses", [0, 1, 100])
def test_a_dive_in_blocks_is_the_dive_frame_by_frame(losses):
    frames = dive(20.0, losses)
    expected = DroneCanDecoder(ESCS)
    readings = one_by_one(expected, frames)
    assert len(readings) > 5000
    for size in (len(frames), 1234):
        decoder, got = DroneCanDecoder(ESCS), []
        for begin in range(0, len(frames), size):
            got += decoder.decode_block(FrameBlock.of(frames[begin : begin + size])).readings()
        assert got == readings
        assert decoder.drops == expected.drops


def test_what_a_receiver_refuses_in_a_regular_pattern_is_refused_in_a_block():
    """A start that is taken for a repetition of one that is too old: what comes after it goes by the one before."""
    six, five = (
        encode_esc_status(EscStatus(0, 16.0, 2.0, 300.0, rpm, 50, 0), 11, number)
        for rpm, number in ((600, 6), (500, 5))
    )
    times = [(10.0, six), (10.0, five[:1]), (12.5, five), (11.0, six)]
    frames = [replace(frame, time_s=time_s) for time_s, several in times for frame in several]
    expected, decoder = DroneCanDecoder(ESCS), DroneCanDecoder(ESCS)
    readings = one_by_one(expected, frames)
    assert len(readings) == 1 and expected.drops["timed out"] == 2 and expected.drops["repeated transfer"] == 3
    assert decoder.decode_block(FrameBlock.of(frames)).readings() == readings
    assert decoder.drops == expected.drops


def test_columns_ascend_by_thruster_and_row_and_none_is_empty():
    block = DroneCanDecoder(WIRED).decode_block(FrameBlock.of(dive(1.0)))
    for columns in (block.commands, block.reports):
        assert [one.thruster for one in columns] == sorted({one.thruster for one in columns})
        assert all(len(one.row) and (np.diff(one.row) > 0).all() for one in columns)


def test_an_empty_block_and_one_of_foreign_frames_give_nothing():
    foreign = [CanFrame(1.0, 0x123, b"\1", extended=False), CanFrame(2.0, 1045 << 8 | 5, bytes(8))]
    decoder = DroneCanDecoder(WIRED)
    assert decoder.decode_block(FrameBlock.of([])) == ReadingBlock()
    assert decoder.decode_block(FrameBlock.of(foreign)) == ReadingBlock()
    assert decoder.drops == {}


@given(st.integers(1, 30), st.lists(st.binary(min_size=30, max_size=30), min_size=1, max_size=5))
def test_crc_of_many_is_the_crc_of_each(size, payloads):
    columns = np.frombuffer(b"".join(payloads), np.uint8).reshape(-1, 30)[:, :size]
    assert crc(ESC_STATUS, columns).tolist() == [ESC_STATUS.crc(one[:size]) for one in payloads]


@given(st.lists(st.tuples(st.integers(1, 3), st.integers(0, 900)), max_size=12), st.data())
@settings(max_examples=25, deadline=None)
def test_rates_of_blocks_are_those_of_single_frames(bursts, data):
    nodes = [node for node, count in bursts for _ in range(count * 9)]
    steps = [data.draw(st.sampled_from([0.0, 0.0001, 0.0003])), data.draw(st.sampled_from([0.0, 0.7, -1.0]))]
    times_s = np.cumsum([steps[0]] * len(nodes))
    times_s[len(nodes) // 2 :] += steps[1]
    expected = FrameRates()
    told = [
        (n, one) for n, row in enumerate(zip(nodes, times_s.tolist(), strict=True)) if (one := expected.take(*row))
    ]
    rates, got = FrameRates(), []
    cut = data.draw(st.integers(0, len(nodes)))
    for begin, end in ((0, cut), (cut, len(nodes))):
        part = rates.take_block(np.array(nodes[begin:end], np.int64), times_s[begin:end])
        got += [(begin + place, one) for place, one in part]
    assert got == told


def test_a_babbling_node_is_told_of_once_in_ten_seconds():
    rates = FrameRates()
    times_s = np.arange(0.0, 25.0, 1.0 / 4000)
    told = rates.take_block(np.full(len(times_s), 7, np.int64), times_s)
    assert [(reading.node_id, reading.frames_per_s) for _, reading in told] == [(7, FRAMES_PER_S_MAX)] * 3
    assert [round(reading.time_s) for _, reading in told] == [1, 11, 21]
    assert all(isinstance(reading, BabblingNode) for _, reading in told)


def test_the_fastest_commander_does_not_babble():
    frames = [frame for n in range(400) for frame in encode_raw_command([1] * 20, 10, n, time_s=n / 400)]
    decoder = DroneCanDecoder(ESCS)
    block = decoder.decode_block(FrameBlock.of(frames))
    assert block.others == () and decoder.drops == Counter()


def test_a_clock_that_jumps_all_the_time_costs_no_memory():
    rates = FrameRates()
    assert rates.take_block(np.full(50_000, 7, np.int64), 1e6 * (np.arange(50_000) % 2)) == []
