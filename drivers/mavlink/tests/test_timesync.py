"""TIMESYNC against an autopilot behind a link with latency, jitter, losses and two routes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.formats import TIMESYNC
from drivers.mavlink.messages import TimeSync
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.mavlink.timesync import ANSWERS_MAX, PERIOD_S, ROUND_TRIP_MAX_S
from drivers.readings import AutopilotClock

UNIX_S = 1_795_336_000.0
BOOTED_S = UNIX_S - 500.0


class Autopilot:
    """ArduPilot's side: its clock, and its system id added to the nanoseconds."""

    def __init__(self, booted_s=BOOTED_S, drift=0.0):
        self.booted_s, self.drift = booted_s, drift
        self.peer = Peer(1, 1)

    def clock_ns(self, time_s):
        return round((time_s - self.booted_s) * (1.0 + self.drift) * 1e9) + 1

    def answer(self, question, time_s):
        return self.peer.pack(dialect.MAVLink_timesync_message(self.clock_ns(time_s), question.asked_ns))


def decoder():
    return MavlinkDecoder([], autopilot_system=1)


def exchanges(decode, autopilot, there_s, back_s, start_s=UNIX_S):
    """One exchange each `PERIOD_S`; NaN: lost."""
    said = []
    for n, (there, back) in enumerate(zip(there_s, back_s, strict=True)):
        asked_s = start_s + n * PERIOD_S
        question = decode.timesync.question(1, asked_s)
        if np.isfinite(there + back):
            said += decode.decode(autopilot.answer(question, asked_s + there), asked_s + there + back)
    return said


def test_one_exchange_gives_the_offset_to_within_half_of_the_round_trip():
    (said,) = exchanges(decoder(), Autopilot(), [0.004], [0.010])
    assert said.system_id == 1 and said.time_s == UNIX_S + 0.014
    assert said.round_trip_s == pytest.approx(0.014, abs=1e-6)
    assert said.offset_s - BOOTED_S == pytest.approx(0.003, abs=1e-6)  # half of the asymmetry


def test_questions_go_to_the_autopilot_every_five_seconds():
    decode = decoder()
    asked = [second for second in range(20) if decode.timesync.question(7, UNIX_S + second)]
    assert asked == [0, 5, 10, 15]
    frame = MavlinkEncoder(7).encode(TimeSync(0, 12, 7, 1))
    (sent,) = messages_in(frame)
    assert (sent.get_type(), sent.tc1, sent.ts1) == ("TIMESYNC", 0, 12)
    assert TIMESYNC.unpack(frame[10:-2]) == (0, 12, 7, 1)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("least_s", "jitter_s"), [(0.0005, 0.002), (0.02, 0.05), (0.25, 0.2)])
def test_jitter_is_seen_through_by_the_quickest_exchange(seed, least_s, jitter_s):
    random = np.random.default_rng(seed)
    there, back = least_s + random.exponential(jitter_s, (2, 200))
    there[random.random(200) < 0.2] = np.nan
    autopilot = Autopilot(drift=20e-6)
    said = exchanges(decoder(), autopilot, there, back)
    assert len(said) > 100
    for one in said[12:]:
        true_s = one.time_s - autopilot.clock_ns(one.time_s) / 1e9
        assert abs(one.offset_s - true_s) <= one.round_trip_s / 2.0 + 0.007  # the drift of a minute, and ours of it
    errors = [abs(one.offset_s - (one.time_s - autopilot.clock_ns(one.time_s) / 1e9)) for one in said[12:]]
    single = np.nanmean(np.abs(there - back)) / 2.0
    assert np.mean(errors) < single + 0.002


def test_a_restart_of_the_autopilot_is_followed_at_once():
    decode = decoder()
    exchanges(decode, Autopilot(), [0.005] * 20, [0.005] * 20)
    later_s = UNIX_S + 200.0
    (said,) = exchanges(decode, Autopilot(later_s - 3.0), [0.3], [0.3], start_s=later_s)
    assert said.offset_s == pytest.approx(later_s - 3.0, abs=1e-6)


def test_an_answer_that_waited_changes_nothing():
    decode = decoder()
    said = exchanges(decode, Autopilot(), [0.005] * 5 + [0.9], [0.005] * 5 + [0.1])
    assert said[-1].offset_s == said[-2].offset_s
    assert said[-1].round_trip_s == said[-2].round_trip_s


def test_an_answer_that_waited_for_too_long_is_dropped():
    decode = decoder()
    assert exchanges(decode, Autopilot(), [0.0], [ROUND_TRIP_MAX_S + 0.1]) == []
    assert decode.drops == {"implausible TIMESYNC answer": 1}


def test_a_second_route_and_answers_to_others_say_nothing():
    decode, autopilot = decoder(), Autopilot()
    question = decode.timesync.question(1, UNIX_S)
    answer = autopilot.answer(question, UNIX_S + 0.01)
    assert len(decode.decode(answer + answer, UNIX_S + 0.02)) == 1
    others = autopilot.answer(TimeSync(0, 987_654, 1, 1), UNIX_S + 0.03)
    impostor = Peer(1, 100).pack(dialect.MAVLink_timesync_message(5, question.asked_ns))
    assert decode.decode(others + impostor, UNIX_S + 0.04) == []
    assert decode.answers() == [] and decode.drops == {}


def test_nobodys_clock_stands_before_its_start():
    decode = decoder()
    question = decode.timesync.question(1, UNIX_S)
    assert decode.decode(Peer().pack(dialect.MAVLink_timesync_message(-5, question.asked_ns)), UNIX_S) == []
    assert decode.drops == {"implausible TIMESYNC answer": 1}


def test_who_asks_is_answered_with_our_clock():
    decode = decoder()
    question = Peer(1, 1).pack(dialect.MAVLink_timesync_message(0, 123_456_789))
    assert decode.decode(question, UNIX_S + 0.25) == []
    (answer,) = decode.answers()
    assert answer == TimeSync(round((UNIX_S + 0.25) * 1e9), 123_456_789, 1, 1)
    (sent,) = messages_in(MavlinkEncoder(1).encode(answer))
    assert (sent.tc1, sent.ts1) == (answer.answered_ns, 123_456_789)


def test_a_question_to_somebody_else_is_not_ours():
    decode, asker = decoder(), MavlinkEncoder(1, 191)
    for system, component in ((1, 1), (2, 192), (2, 0)):
        decode.decode(asker.encode(TimeSync(0, 1, system, component)), UNIX_S)
    assert decode.answers() == []
    for system, component in ((1, 192), (0, 0), (1, 0)):
        decode.decode(asker.encode(TimeSync(0, 1, system, component)), UNIX_S)
    assert len(decode.answers()) == 3


def test_questions_beyond_reason_are_not_answered():
    decode, asker = decoder(), Peer(1, 100)
    for n in range(3 * ANSWERS_MAX):
        decode.decode(asker.pack(dialect.MAVLink_timesync_message(0, n + 1)), UNIX_S + n * 1e-3)
    assert len(decode.answers()) == ANSWERS_MAX
    assert decode.drops == {f"TIMESYNC beyond {ANSWERS_MAX} a second": 2 * ANSWERS_MAX}


INT64 = st.integers(-(2**63), 2**63 - 1)


@given(st.lists(st.tuples(INT64, st.one_of(INT64, st.just(None))), max_size=8))
def test_no_answer_raises_or_gives_what_is_not_finite(answers):
    decode, peer = decoder(), Peer()
    for n, (answered_ns, asked_ns) in enumerate(answers):
        time_s = UNIX_S + n * PERIOD_S
        question = decode.timesync.question(1, time_s)
        message = dialect.MAVLink_timesync_message(answered_ns, question.asked_ns if asked_ns is None else asked_ns)
        for said in decode.decode(peer.pack(message), time_s + 0.01):
            assert isinstance(said, AutopilotClock)
            assert np.isfinite(said.offset_s) and 0.0 <= said.round_trip_s <= ROUND_TRIP_MAX_S
