"""Stamps of frames on a bus that carries one at a time."""

from __future__ import annotations

import pytest

from hil_tests.rig.bus_clock import BusClock, Unsent

FRAME = Unsent(0x123, bytes(8))
LONG_S = (54 * 1.1 + 13 + 8 * 8.8) / 1e6  # 29 bits of identifier, eight bytes, a tenth of the bits stuffed


def test_a_frame_is_received_when_its_last_bit_is():
    [frame] = BusClock(1_000_000).send(10.0, [FRAME])
    assert frame.time_s == pytest.approx(10.0 + LONG_S)
    assert (frame.identifier, frame.data, frame.extended) == (0x123, bytes(8), True)
    [slower] = BusClock(250_000).send(10.0, [FRAME])
    assert slower.time_s == pytest.approx(10.0 + 4.0 * LONG_S)


def test_who_comes_while_the_bus_is_taken_waits():
    clock = BusClock(1_000_000)
    first = clock.send(10.0, [FRAME, FRAME])
    second = clock.send(10.0, [FRAME])
    stamps = [frame.time_s - 10.0 for frame in (*first, *second)]
    assert stamps == pytest.approx([LONG_S, 2.0 * LONG_S, 3.0 * LONG_S])
    [later] = clock.send(11.0, [FRAME])
    assert later.time_s == pytest.approx(11.0 + LONG_S)


def test_short_frames_with_short_identifiers_are_quicker():
    short = BusClock(1_000_000).send(10.0, [Unsent(0x123, b"", extended=False)])
    assert short[0].time_s < 10.0 + 0.5 * LONG_S
    assert not short[0].extended
