"""Framing of damaged streams."""

from collections import Counter
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.frames import FrameScanner, frame_at
from drivers.mavlink.tests.peer import EscStatusMessage, Peer

ATTITUDE, HEARTBEAT, ESC_STATUS = 30, 0, 291


def scanner(*wanted):
    drops = Counter()
    return FrameScanner(wanted or (ATTITUDE, HEARTBEAT, ESC_STATUS), drops), drops


def frames(count, **options):
    peer = Peer(**options)
    return [peer.attitude(1000 + i) if i % 2 else peer.heartbeat() for i in range(count)]


@given(st.lists(st.integers(1, 60), max_size=40))
def test_cut_anywhere(cuts):
    stream = b"".join(frames(20))
    scan, drops = scanner()
    packets, position = [], 0
    for cut in [*cuts, len(stream)]:
        packets += scan.feed(stream[position : position + cut], 0.0)
        position += cut
    assert len(packets) == 20
    assert not drops


@given(st.lists(st.binary(max_size=300), max_size=20))
def test_garbage_never_raises_and_every_byte_is_accounted_for(chunks):
    scan, drops = scanner()
    for chunk in chunks:
        assert scan.pending <= 280
        scan.feed(chunk, 0.0)
    if not drops["unknown message"]:
        assert drops["bytes outside frames"] + scan.pending == sum(map(len, chunks))


@given(st.binary(min_size=1, max_size=400), st.booleans())
def test_a_good_frame_is_found_at_once_whatever_came_before(garbage, mavlink1):
    scan, _ = scanner()
    good = Peer().attitude(mavlink1=mavlink1)
    assert len(scan.feed(b"\x00" + garbage + good, 0.0)) == 1


@given(st.integers(0, 800), st.integers(1, 255))
def test_a_flipped_byte_costs_its_own_frame_only(place, flip):
    sent = frames(20)
    stream = bytearray(b"".join(sent))
    place %= len(stream)
    stream[place] ^= flip
    scan, drops = scanner()
    found = scan.feed(bytes(stream), 0.0)
    found += scan.feed(Peer().heartbeat(), 1.0)  # a length that grew is waited for, but not for ever
    assert 20 <= len(found) <= 21
    assert sum(drops.values()) > 0 or len(found) == 21


@given(st.data())
def test_mutated_streams_never_raise(data):
    stream = bytearray(b"".join(frames(12)))
    for _ in range(data.draw(st.integers(1, 12))):
        start = data.draw(st.integers(0, len(stream) - 1))
        stream[start : start + data.draw(st.integers(0, 30))] = data.draw(st.binary(max_size=30))
        stream = stream or bytearray(b"\xfd")
    scan, _ = scanner()
    for start in range(0, len(stream), 17):
        scan.feed(bytes(stream[start : start + 17]), 0.0)
    assert scan.feed(bytes(300) + Peer().heartbeat(), 9.0)[-1].message_id == HEARTBEAT


class OpenGate:
    """Lets all in. With any gate, every frame is found the careful way."""

    def refusal(self, frame, packet, time_s):
        return ""


@given(st.data())
def test_the_quick_way_and_the_careful_one_find_the_same(data):
    mixed = [Peer(system=1 + i % 2).attitude(i, mavlink1=data.draw(st.booleans())) for i in range(4)]
    stream = bytearray(b"".join([*frames(8), *mixed, *frames(4)]))
    for _ in range(data.draw(st.integers(0, 6))):
        start = data.draw(st.integers(0, len(stream)))
        stream[start : start + data.draw(st.integers(0, 30))] = data.draw(st.binary(max_size=30))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    quick_drops, careful_drops = Counter(), Counter()
    quick = FrameScanner((ATTITUDE,), quick_drops)
    careful = FrameScanner((ATTITUDE,), careful_drops, OpenGate())
    for number, (begin, end) in enumerate(pairwise([0, *cuts, len(stream)])):
        part, time_s = bytes(stream[begin:end]), number * data.draw(st.sampled_from([0.01, 0.2]))
        assert quick.feed(part, time_s) == careful.feed(part, time_s)
        assert (quick_drops, quick.pending) == (careful_drops, careful.pending)


def test_a_frame_cut_off_by_silence_does_not_hold_up_the_next():
    scan, drops = scanner()
    assert scan.feed(Peer().attitude()[:12], 0.0) == []
    assert len(scan.feed(Peer().heartbeat(), 1.0)) == 1
    assert drops["bytes outside frames"] == 12


def test_a_truncated_frame_is_found_out_when_its_length_is_filled():
    scan, _ = scanner()
    found = scan.feed(Peer().attitude()[:-3], 0.0)
    for sent in frames(4):
        found += scan.feed(sent, 0.01)
    assert len(found) == 4


def test_signed_frames_are_taken():
    scan, drops = scanner()
    assert len(scan.feed(b"".join(frames(6, key=bytes(32))), 0.0)) == 6
    assert not drops


def test_bad_checksums_are_counted_one_by_one():
    scan, drops = scanner()
    for sent in frames(10):
        bad = bytearray(sent)
        bad[-1] ^= 0x55
        scan.feed(bytes(bad), 0.0)
    assert drops["checksum"] == 10


def test_frames_that_ask_for_the_unknown_are_refused():
    scan, drops = scanner()
    odd = bytearray(Peer().attitude())
    odd[2] = 0x02
    assert scan.feed(bytes(odd) + Peer().heartbeat(), 0.0)[0].message_id == HEARTBEAT
    assert drops["unsupported flags"] == 1


def test_a_message_of_another_dialect_is_skipped_whole():
    class Foreign(EscStatusMessage):
        id = 65_000

    foreign = Foreign(0xFD, 2**63 + 0xFD, (0xFDFD,) * 4, (1.0,) * 4, (2.0,) * 4)
    foreign._header.msgId = 65_000
    peer = Peer()
    scan, drops = scanner()
    assert len(scan.feed(peer.heartbeat() + peer.pack(foreign) + peer.heartbeat(), 0.0)) == 2
    assert drops == {"unknown message": 1}


def test_losses_are_counted_per_sender_and_repeats_are_not_losses():
    one, other = frames(6), frames(6, system=2)
    scan, drops = scanner()
    for sent in (one[0], other[0], one[1], one[1], other[1], one[4], one[5]):
        scan.feed(sent, 0.0)
    assert drops == {"lost in transit": 2}


def test_header_of_both_versions():
    for mavlink1 in (False, True):
        frame = frame_at(Peer(system=7, component=9).attitude(mavlink1=mavlink1), 0)
        assert (frame.message_id, frame.system_id, frame.component_id) == (ATTITUDE, 7, 9)
