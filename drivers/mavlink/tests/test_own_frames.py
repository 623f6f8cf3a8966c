"""Our own frames coming back, and another program that sends with our ids."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.encoder import MavlinkEncoder, frames_of
from drivers.mavlink.messages import CompanionHeartbeat, CompanionState, NamedValue, StatusText
from drivers.mavlink.own_frames import KEPT, REPEAT_S
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.readings import IdentityConflict

BEAT = CompanionHeartbeat(CompanionState.ACTIVE)


class Us:
    """Decoder and encoder as the gateway joins them."""

    def __init__(self):
        self.decoder = MavlinkDecoder([], autopilot_system=1)
        self.encoder = MavlinkEncoder(1)

    def send(self, message, time_s=0.0):
        data = self.encoder.encode(message)
        self.decoder.own.sent(data, time_s)
        return data


def test_what_comes_back_is_ours_by_every_route():
    us = Us()
    sent = [us.send(BEAT, float(second)) for second in range(300)]
    for second, data in enumerate(sent):
        assert us.decoder.decode(data + data, second + 3.0) == []
    assert us.decoder.drops == {"our own, coming back": 600}


def test_a_router_may_fill_up_zeros_that_we_cut_off():
    us = Us()
    us.send(CompanionHeartbeat(CompanionState.ACTIVE))
    again = Peer(1, 192)  # MAVLink 1 cuts nothing off
    message = dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)
    assert us.decoder.decode(again.pack(message, mavlink1=True), 0.0) == []
    assert us.decoder.drops == {"our own, coming back": 1}


def test_another_program_with_our_ids_is_noticed_and_said_again():
    us, other, said = Us(), Peer(1, 192), []
    for _ in range(100):
        other.pack(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))  # it began long before us
    for second in range(30):
        own = us.send(BEAT, float(second))
        theirs = other.heartbeat(autopilot=8, vehicle_type=18, base_mode=0, custom_mode=0, state=4)
        said += us.decoder.decode(own + theirs, float(second))
    assert said[0] == IdentityConflict(2.0, 1, 192)
    assert [one.time_s for one in said] == [2.0, 2.0 + REPEAT_S, 2.0 + 2.0 * REPEAT_S]
    assert us.decoder.drops["another's, with our ids"] == 30


def test_the_same_program_started_twice_is_noticed_although_it_says_the_same():
    us, twin, said = Us(), Us(), []
    for second in range(60):
        us.send(BEAT, float(second))
        if second >= 20:  # when it is started, too
            said += us.decoder.decode(twin.send(BEAT), float(second))
    assert said[0].time_s == 22.0


def test_the_last_words_of_the_run_before_are_no_conflict():
    us, before = Us(), Us()
    late = b"".join(before.send(NamedValue("STW", 1.0 + n, n)) + before.send(BEAT) for n in range(20))
    assert us.decoder.decode(late, 0.0) == []
    for second in range(1, 60):
        assert us.decoder.decode(us.send(BEAT, float(second)), second + 0.1) == []


def test_a_stranger_now_and_then_is_no_conflict():
    us, other = Us(), Peer(1, 192)
    for n in range(20):
        data = other.heartbeat(autopilot=8, vehicle_type=18, base_mode=0, custom_mode=0, state=3)
        assert us.decoder.decode(data, n * (REPEAT_S + 1.0)) == []


def test_memory_is_bounded():
    us = Us()
    first = us.send(NamedValue("STW", -1.0, 0.0)) + us.send(BEAT)
    for n in range(2 * KEPT):
        us.send(NamedValue("STW", float(n), n))
    assert len(us.decoder.own._sent) == KEPT
    us.decoder.decode(first, 1.0)
    assert us.decoder.drops == {"another's, with our ids": 1}  # named values are not even looked at


@pytest.mark.parametrize("length", [51, 100, 149, 200])
def test_every_chunk_of_a_long_text_is_known_again(length):
    us = Us()
    data = us.send(StatusText(6, "x" * length))
    assert len(list(frames_of(data))) == length // 50 + 1 == len(messages_in(data))
    assert len(us.decoder.own._sent) == length // 50 + 1


@given(st.lists(st.integers(51, 200), min_size=1, max_size=3))
def test_frames_are_cut_where_they_end(lengths):
    encoder = MavlinkEncoder(9)
    data = b"".join(encoder.encode(StatusText(6, "y" * length)) for length in lengths)
    assert b"".join(frames_of(data)) == data
    assert all(len(messages_in(frame)) == 1 for frame in frames_of(data))
