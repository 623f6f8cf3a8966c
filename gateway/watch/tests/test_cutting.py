"""A stretch in bits: nothing is lost, nothing comes twice, and the order stays."""

import numpy as np
import pytest

from drivers.reading_block import ReadingBlock
from drivers.readings import LinkState, ThrusterCommand, ThrusterReport
from gateway.stretches.stretch import BlockArrival, Stretch
from gateway.watch.cutting import Bits


def arrivals(places: bool) -> list[BlockArrival]:
    """Two links over ten seconds; one reading in ten of the first is stamped earlier than the one before."""
    first = [
        ThrusterCommand(0.05 * n - (0.2 if n % 10 == 5 else 0.0), 1, 0.5)
        if n % 2
        else LinkState(0.05 * n, "a", True, "")
        for n in range(200)
    ]
    second = [ThrusterReport(0.1 * n + 0.01, 1, 900.0) for n in range(100)]
    blocks = [ReadingBlock.of(first), ReadingBlock.of(second)]
    if not places:
        return [BlockArrival(link, block) for link, block in zip("ab", blocks, strict=True)]
    order = [np.arange(block.rows, dtype=np.float64) * step for block, step in zip(blocks, (1.0, 2.0), strict=True)]
    return [BlockArrival(link, block, place) for link, block, place in zip("ab", blocks, order, strict=True)]


def read(stretch: list[BlockArrival]) -> list:
    return [(link, reading) for _, link, reading in Stretch.of(stretch).readings()]


@pytest.mark.parametrize("places", [False, True])
@pytest.mark.parametrize("length_s", [0.0, 0.05, 0.33, 3.0, 100.0])
def test_all_bits_together_are_the_stretch(places, length_s):
    bits, pieces, begins_s = Bits(arrivals(places)), [], []
    while np.isfinite(bits.begin_s):
        begins_s.append(bits.begin_s)
        pieces.append(bits.take(length_s))
    assert [one for piece in pieces for one in read(piece)] == read(arrivals(places))
    assert begins_s == sorted(begins_s)
    assert (len(pieces) == 1) == (length_s == 100.0)


def test_each_bit_is_as_long_as_it_is_wanted():
    bits = Bits(arrivals(places=False))
    for length_s in (1.0, 0.5, 4.0):
        begin_s = bits.begin_s
        latest_s = max(float(one.readings.times()[1].max()) for one in bits.take(length_s))
        assert begin_s + length_s - 0.11 < latest_s < begin_s + length_s


def test_of_nothing_there_is_no_bit():
    bits = Bits([BlockArrival("a", ReadingBlock())])
    assert bits.begin_s == np.inf and bits.take(1.0) == []
