"""Signatures, in and out, against pymavlink's own, and what an attacker or a wrong clock could do with them."""

import copy
import logging
import pickle
import struct
import traceback
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.frames import FrameScanner, frame_at
from drivers.mavlink.messages import (
    CommandAck,
    CommandLong,
    CompanionHeartbeat,
    CompanionState,
    ComputerStatus,
    NamedValue,
    StatusText,
    TimeSync,
)
from drivers.mavlink.signing import (
    EPOCH_S,
    FUTURE,
    MINUTE,
    REFUSALS,
    REPLAYED,
    STAMP_END,
    STREAMS_MAX,
    TICKS_PER_S,
    TOO_MANY,
    TOO_OLD,
    UNSIGNED,
    WRONG_KEY,
    Signing,
    SigningHistory,
    SigningKey,
    latest_stamp,
    stamp_of,
)
from drivers.mavlink.tests.peer import Peer

SECRET = bytes(range(1, 33))
KEY = SigningKey(SECRET)
NOW_S = 1_795_300_000.25  # in November 2026
NOW = stamp_of(NOW_S)
ATTITUDE, HEARTBEAT, RADIO_STATUS = 30, 0, 109


def signed_peer(stamp=NOW, secret=SECRET, link_id=0, **options):
    peer = Peer(key=secret, **options)
    peer.mav.signing.timestamp = stamp
    peer.mav.signing.link_id = link_id
    return peer


class Listener:
    """A scanner with a gate, at one instant unless told otherwise."""

    def __init__(self, **options):
        self.signing = Signing(KEY, NOW_S, **options)
        self.drops = Counter()
        self._scanner = FrameScanner((ATTITUDE, HEARTBEAT, RADIO_STATUS), self.drops, self.signing)

    def hear(self, data, time_s=NOW_S):
        return self._scanner.feed(data, time_s)


def judged(listener, data, time_s=NOW_S):
    """The cause for which a packet is refused, "" if it is taken."""
    before = Counter(listener.drops)
    taken = listener.hear(data, time_s)
    (cause,) = list(listener.drops - before) or [""]
    assert bool(taken) == (cause == "")
    return cause


def readable(data, secret=SECRET, clock=0):
    """What pymavlink, which has the key, takes of `data`."""
    link = dialect.MAVLink(None)
    link.robust_parsing = True
    link.signing.secret_key = secret
    link.signing.timestamp = clock
    return [one for one in link.parse_buffer(data) or [] if one.get_type() != "BAD_DATA"]


@given(stamp=st.integers(NOW - MINUTE, latest_stamp(NOW_S)), link_id=st.integers(0, 255), roll=st.floats(width=32))
def test_what_pymavlink_signs_is_taken(stamp, link_id, roll):
    listener, peer = Listener(), signed_peer(stamp, link_id=link_id)
    (packet,) = listener.hear(peer.attitude(roll=roll))
    assert packet.signed and not listener.drops
    assert listener.signing.clock(NOW_S) == max(NOW, stamp)


@given(data=st.data(), link_id=st.integers(0, 255))
def test_what_we_sign_is_taken_by_pymavlink(data, link_id):
    signing = Signing(KEY, NOW_S, link_id)
    unsigned = Peer(system=data.draw(st.integers(1, 254)), component=192)
    text = data.draw(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=50))
    sent = [
        dialect.MAVLink_statustext_message(4, text.encode()),
        dialect.MAVLink_command_long_message(1, 1, 176, 0, *[float("nan")] * 7),
        dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3),
    ]
    stream = b"".join(signing.sign(unsigned.pack(message), NOW_S) for message in sent)
    heard = readable(stream, clock=NOW)
    assert [one.get_msgId() for one in heard] == [one.get_msgId() for one in sent]
    assert all(one.get_signed() and one.get_link_id() == link_id for one in heard)
    assert heard[0].text == text.rstrip("\0")
    assert not readable(stream, secret=bytes(reversed(SECRET)), clock=NOW)
    assert len(Listener().hear(stream)) == 1  # of what it wants, the heartbeat


def test_signature_is_as_the_specification_says():
    """Layout and hash by hand: link id, 48-bit little-endian stamp, 48 bits of SHA-256."""
    import hashlib

    packet = Signing(KEY, NOW_S, link_id=7).sign(Peer().heartbeat(), NOW_S)
    assert packet[2] == 1  # MAVLINK_IFLAG_SIGNED
    link_id, low, high = struct.unpack("<BIH", packet[-13:-6])
    assert (link_id, low | high << 32) == (7, round((NOW_S - 1_420_070_400) * 1e5))
    assert packet[-6:] == hashlib.sha256(SECRET + packet[:-6]).digest()[:6]


def test_unsigned_is_refused_in_both_versions():
    listener = Listener()
    assert judged(listener, Peer().attitude()) == UNSIGNED
    assert judged(listener, Peer().attitude(mavlink1=True)) == UNSIGNED
    assert listener.drops == {UNSIGNED: 2}


def test_unsigned_is_taken_where_that_was_asked_for_but_does_not_count_as_signed():
    listener = Listener(accept_unsigned=True)
    for data in (Peer().attitude(), Peer(system=2).attitude(mavlink1=True)):
        (packet,) = listener.hear(data)
        assert not packet.signed
    assert judged(listener, signed_peer(secret=bytes(31) + b"x", system=3).attitude()) == WRONG_KEY
    (packet,) = listener.hear(signed_peer(system=4).attitude())
    assert packet.signed


def test_what_a_telemetry_radio_puts_in_between_is_no_attack():
    listener = Listener()
    radio = Peer(system=51, component=68).pack(dialect.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7))
    (packet,) = listener.hear(radio)
    assert not packet.signed and not listener.drops


def test_another_key():
    assert judged(Listener(), signed_peer(secret=bytes(reversed(SECRET))).attitude()) == WRONG_KEY


@given(st.data())
def test_any_flipped_bit_is_found(data):
    packet = bytearray(signed_peer().attitude())
    place = data.draw(st.integers(0, len(packet) * 8 - 1))
    packet[place // 8] ^= 1 << place % 8
    listener = Listener()
    assert not listener.hear(bytes(packet) + bytes(300))
    assert sum(listener.drops.values()) > 0
    if place // 8 >= len(packet) - 13:  # in the signature: nothing else can have found it
        assert listener.drops[WRONG_KEY] == 1


@given(st.data())
def test_a_checksum_made_right_again_does_not_help(data):
    """Whoever changes a packet can compute its checksum, but not its signature."""
    packet = bytearray(signed_peer().attitude())
    place = data.draw(st.integers(3, len(packet) - 16))
    packet[place] ^= data.draw(st.integers(1, 255))
    frame = frame_at(bytes(packet), 0)
    crc_extra = dialect.mavlink_map[frame.message_id].crc_extra if frame.message_id in dialect.mavlink_map else 0
    packet[-15:-13] = struct.pack("<H", dialect.x25crc(packet[1:-15] + bytes([crc_extra])).crc)
    assert not Listener().hear(bytes(packet))


@given(st.integers(1, 13))
def test_a_signature_cut_off_is_waited_for_and_refused(missing):
    listener, packet = Listener(), signed_peer().attitude()
    assert not listener.hear(packet[:-missing])
    assert not listener.hear(Peer(system=9).heartbeat(), NOW_S + 1.0)
    assert len(listener.hear(signed_peer(system=2).attitude(), NOW_S + 2.0)) == 1


def test_the_flag_without_a_signature_is_no_way_in():
    """A packet with its flag taken away, and its checksum made right, is simply unsigned."""
    packet = bytearray(signed_peer().attitude())[:-13]
    packet[2] = 0
    packet[-2:] = struct.pack("<H", dialect.x25crc(packet[1:-2] + bytes([39])).crc)
    assert judged(Listener(), bytes(packet)) == UNSIGNED


def test_nothing_is_taken_twice():
    listener, peer = Listener(), signed_peer()
    first, second = peer.attitude(), peer.attitude()
    assert [judged(listener, one) for one in (second, second, first)] == ["", REPLAYED, REPLAYED]
    assert listener.drops == {REPLAYED: 2}


@given(st.lists(st.tuples(st.sampled_from([(1, 1, 0), (1, 1, 1), (1, 2, 0), (2, 1, 0)]), st.integers(-80, 80))))
def test_stamps_rise_in_every_stream_and_no_stream_begins_a_minute_behind(sent):
    """Against the rule itself, written down once more: streams, and a clock that follows."""
    listener, newest, clock = Listener(), {}, NOW
    for (system, component, link_id), ago_s in sent:
        stamp = NOW + ago_s * TICKS_PER_S
        stream = (system, component, link_id)
        packet = signed_peer(stamp, link_id=link_id, system=system, component=component).attitude()
        cause = judged(listener, packet)
        if stream in newest:
            assert cause == ("" if stamp > newest[stream] else REPLAYED)
        else:
            assert cause == ("" if stamp >= clock - MINUTE else TOO_OLD)
        if not cause:
            newest[stream], clock = stamp, max(clock, stamp)
    assert listener.signing.clock(NOW_S) == clock


def packet_of(kind, system, stamp):
    match kind:
        case "signed":
            return signed_peer(stamp, system=system).attitude()
        case "wrong key":
            return signed_peer(stamp, SECRET[::-1], system=9).attitude()
        case "radio":
            return Peer(system=51).pack(dialect.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7))
    return Peer(system=system).attitude(mavlink1=kind == "version 1")


@given(
    sent=st.lists(
        st.tuples(
            st.sampled_from(["signed", "unsigned", "version 1", "radio", "wrong key"]),
            st.integers(1, 3),
            st.integers(-90, 90),
        ),
        max_size=20,
    ),
    lenient=st.booleans(),
)
def test_we_take_what_pymavlink_takes(sent, lenient):
    """The same packets to both. Wrong keys have a system of their own: pymavlink notes their stamps all the same."""
    listener, link = Listener(accept_unsigned=lenient), dialect.MAVLink(None)
    link.robust_parsing = True
    link.signing.secret_key, link.signing.timestamp = SECRET, NOW
    signed_now = [False]
    link.signing.allow_unsigned_callback = lambda _, number: not signed_now[0] and (lenient or number == RADIO_STATUS)
    for kind, system, ago_s in sent:
        signed_now[0] = kind in ("signed", "wrong key")
        packet = packet_of(kind, system, NOW + ago_s * TICKS_PER_S)
        theirs = [one for one in link.parse_buffer(packet) or [] if one.get_type() != "BAD_DATA"]
        ours = listener.hear(packet)
        assert len(ours) == len(theirs)
        assert [one.signed for one in ours] == [one.get_signed() for one in theirs]
    assert listener.signing.clock(NOW_S) == link.signing.timestamp


def test_a_forged_stamp_moves_nothing():
    """Who has no key can neither push our clock ahead nor spoil a stream (as with a stamp noted before the proof)."""
    listener = Listener()
    forged = signed_peer(NOW + 50 * MINUTE, secret=bytes(reversed(SECRET)))
    assert judged(listener, forged.attitude()) == WRONG_KEY
    assert listener.signing.clock(NOW_S) == NOW
    assert judged(listener, signed_peer(NOW + 1).attitude()) == ""


def stamp_2090():
    return round((3_786_912_000 - EPOCH_S) * TICKS_PER_S)


@pytest.mark.parametrize("stamp", [stamp_2090(), STAMP_END - 1, latest_stamp(NOW_S) + 1])
def test_a_peer_from_the_far_future_is_not_followed(stamp):
    """Followed to 2090 we would take no other peer any more, and at the end of all stamps send nothing."""
    listener = Listener()
    assert judged(listener, signed_peer(stamp).attitude()) == FUTURE
    assert listener.signing.clock(NOW_S) == NOW
    assert judged(listener, signed_peer(NOW + 1).attitude()) == ""


def test_an_autopilot_that_adds_a_minute_at_every_boot_is_followed():
    listener = Listener()
    for boot in range(1, 200):
        assert judged(listener, signed_peer(NOW + boot * MINUTE).attitude()) == ""
    ours = listener.signing.sign(Peer(component=192).heartbeat(), NOW_S)
    assert len(readable(ours, clock=NOW + 199 * MINUTE)) == 1


def test_a_machine_that_wakes_up_in_1970_learns_the_time():
    listener = Listener()
    listener.signing = Signing(KEY, 12.0)
    listener._scanner = FrameScanner((ATTITUDE,), listener.drops, listener.signing)
    assert listener.signing.clock(12.0) == 0
    assert judged(listener, signed_peer(NOW).attitude(), 12.0) == ""
    assert listener.signing.clock(13.0) == NOW + TICKS_PER_S
    assert len(readable(listener.signing.sign(Peer(component=192).heartbeat(), 14.0), clock=NOW + MINUTE)) == 1


def test_our_stamps_follow_the_time_and_never_repeat():
    signing = Signing(KEY, NOW_S)
    stamps = [stamp_in(signing.sign(Peer().heartbeat(), time_s)) for time_s in (NOW_S, NOW_S, NOW_S - 5, NOW_S + 3)]
    assert stamps == [NOW, NOW + 1, NOW + 2, NOW + 3 * TICKS_PER_S]


@pytest.mark.parametrize("time_s", [-1e12, 0.0, 1e12])
def test_stamps_fit_whatever_the_machine_takes_for_the_time(time_s):
    signing = Signing(KEY, time_s)
    assert 0 <= stamp_in(signing.sign(Peer().heartbeat(), time_s)) < STAMP_END
    assert latest_stamp(time_s) < STAMP_END
    assert signing.history(time_s).believable(time_s)


def stamp_in(packet):
    return int.from_bytes(packet[-12:-6], "little")


@given(
    sent=st.integers(0, 30),
    ahead=st.integers(0, 10_000),
    clean=st.booleans(),
    wall_s=st.sampled_from([0.0, 1.4e9, NOW_S - 86_400, NOW_S, NOW_S + 3600]),
)
def test_stamps_go_on_rising_after_a_restart_whatever_the_clock_then_says(sent, ahead, clean, wall_s):
    before = Signing(KEY, NOW_S)
    heard = Listener()
    heard.signing = before
    heard._scanner = FrameScanner((ATTITUDE,), heard.drops, before)
    assert judged(heard, signed_peer(NOW + ahead).attitude()) == ""
    kept = before.history(NOW_S)
    stamps = [stamp_in(before.sign(Peer().heartbeat(), NOW_S + 4.0 * i)) for i in range(sent)]
    kept = before.history(NOW_S + 4.0 * sent, reserve=False) if clean else kept
    after = Signing(KEY, wall_s, history=kept)
    assert stamp_in(after.sign(Peer().heartbeat(), wall_s)) > max(stamps, default=-1)
    assert after.clock(wall_s) >= kept.clock


def test_a_recording_cannot_be_played_to_the_next_run():
    listener = Listener()
    packet = signed_peer().attitude()
    assert judged(listener, packet) == ""
    assert judged(Listener(history=listener.signing.history(NOW_S)), packet) == REPLAYED


def test_clean_restarts_do_not_run_ahead_of_the_time():
    history = None
    for _ in range(100):
        signing = Signing(KEY, NOW_S, history=history)
        signing.sign(Peer().heartbeat(), NOW_S)
        history = signing.history(NOW_S, reserve=False)
    assert history.reserved == NOW + 99 and history.clock == NOW


def test_streams_cannot_fill_the_memory():
    listener = Listener()
    for number in range(STREAMS_MAX):
        assert judged(listener, signed_peer(link_id=number).attitude()) == ""
    assert judged(listener, signed_peer(system=2).attitude()) == TOO_MANY
    assert judged(listener, signed_peer(NOW + 9).attitude()) == ""


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: SigningKey(b"short"), "32 bytes, got 5"),
        (lambda: SigningKey(bytes(32)), "zeros"),
        (lambda: Signing(KEY, NOW_S, link_id=256), "link_id must lie in 0..255, got 256"),
        (lambda: Signing(KEY, NOW_S, history=SigningHistory(clock=STAMP_END - 1)), "far future"),
        (lambda: SigningHistory(clock=-1), "clock must be a stamp"),
        (lambda: SigningHistory(reserved=STAMP_END), "reserved must be a stamp"),
        (lambda: SigningHistory(streams={(1, 1, 256): 5}), "each in 0..255"),
        (lambda: SigningHistory(streams={(1, 1): 5}), "link id"),
        (lambda: Signing(KEY, NOW_S).sign(b"", NOW_S), "one unsigned MAVLink 2 packet"),
        (lambda: Signing(KEY, NOW_S).sign(Peer().heartbeat(mavlink1=True), NOW_S), "one unsigned MAVLink 2 packet"),
        (lambda: Signing(KEY, NOW_S).sign(signed_peer().heartbeat(), NOW_S), "one unsigned MAVLink 2 packet"),
        (lambda: Signing(KEY, NOW_S).sign(2 * Peer().heartbeat(), NOW_S), "one unsigned MAVLink 2 packet"),
    ],
)
def test_callers_mistakes(wrong, said):
    with pytest.raises(ValueError, match=said):
        wrong()


def test_passphrase_makes_the_key_that_mavproxy_makes():
    proxy = pytest.importorskip("MAVProxy.modules.mavproxy_signing")
    theirs = proxy.SigningModule.passphrase_to_key(None, "correct horse")
    assert SigningKey.from_passphrase("correct horse").proof(b"x") == SigningKey(theirs).proof(b"x")


def test_nothing_shows_the_key(caplog):
    """Neither as text, nor as bytes in any usual notation, in a log or in an exception with its chain."""
    caplog.set_level(logging.DEBUG)
    secret = b"a passphrase of thirty-two bytes"
    listener = Listener()
    listener.signing = Signing(SigningKey(secret), NOW_S)
    logging.getLogger("gateway").info("%s %r %s", listener.signing, SigningKey(secret), vars(listener.signing))
    said = [caplog.text, repr(SigningKey(secret)), str(listener.signing.history(NOW_S))]
    for wrong in (
        lambda: SigningKey(secret + b"x"),
        lambda: listener.signing.sign(secret, NOW_S),
        lambda: Signing(SigningKey(secret), NOW_S, 256),
        lambda: pickle.dumps(SigningKey(secret)),
        lambda: pickle.dumps(listener.signing),
        lambda: copy.copy(SigningKey(secret)),
    ):
        with pytest.raises((ValueError, TypeError)) as caught:
            wrong()
        said += traceback.format_exception(caught.value)
    for notation in (secret.decode(), secret.hex(), repr(secret), str(list(secret))):
        assert not any(notation in text for text in said)


@given(
    cuts=st.lists(st.integers(1, 60), max_size=40),
    garbage=st.lists(st.one_of(st.just(b""), st.binary(max_size=20)), min_size=12, max_size=12),
)
def test_no_packet_is_asked_about_twice_however_the_stream_is_cut(cuts, garbage):
    """Looked at again with the bytes that come next, a good packet would pass for one that is played again."""
    peer, listener = signed_peer(), Listener()
    stream = b"".join(noise + peer.attitude() for noise in garbage)
    position = 0
    for cut in [*cuts, len(stream)]:
        listener.hear(stream[position : position + cut])
        position += cut
    listener.hear(bytes(300), NOW_S + 1.0)
    assert not listener.drops.keys() & set(REFUSALS)


def test_epoch():
    assert stamp_of(EPOCH_S) == 0 and stamp_of(EPOCH_S + 1.0) == 100_000


def test_encoder_signs_every_frame_of_every_message():
    encoder = MavlinkEncoder(1, signing=Signing(KEY, NOW_S, link_id=3))
    stream = b"".join(
        encoder.encode(message, NOW_S + place)
        for place, message in enumerate(
            [
                CompanionHeartbeat(CompanionState.ACTIVE),
                StatusText(4, "T3 entangled? " + 100 * "x"),  # three chunks
                CommandLong(176, (1.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1),
                CommandAck(31010, 0, 255, 190),
                NamedValue("T3", 0.5, 1.0),
                TimeSync(0, 1, 1, 1),
                ComputerStatus(unix_s=NOW_S, uptime_s=5.0),
            ]
        )
    )
    heard = readable(stream, clock=NOW)
    assert len(heard) == 9 and all(one.get_signed() and one.get_link_id() == 3 for one in heard)
    with pytest.raises(ValueError, match="time_s must be given"):
        encoder.encode(CompanionHeartbeat(CompanionState.ACTIVE))


def test_decoder_reads_only_who_has_the_key():
    decoder = MavlinkDecoder([], gate=Signing(KEY, NOW_S))
    assert decoder.decode(Peer().heartbeat(), NOW_S) == []
    assert decoder.autopilot_system is None
    (heartbeat,) = decoder.decode(signed_peer().heartbeat(), NOW_S)
    assert heartbeat.system_id == 1
    assert decoder.drops == {UNSIGNED: 1}
