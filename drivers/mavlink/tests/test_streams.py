"""Asking for streams: an autopilot played by hand, with the time in our hand too."""

import itertools
from collections import Counter

import pytest

from drivers.mavlink.streams import Stream, StreamRequests
from drivers.readings import Attitude, AutopilotHeartbeat, AutopilotReboot, CommandAcknowledgement, LinkState

ACCEPTED, TEMPORARILY_REJECTED, DENIED, IN_PROGRESS = 0, 1, 2, 5
STREAMS = (Stream(36, 20.0), Stream(11030, 20.0), Stream(226, 10.0))


def heartbeat(time_s, system_id=1, autopilot=3):
    return AutopilotHeartbeat(time_s, system_id, 1, autopilot, 12, False, 19, 4)


def answer(time_s, result=ACCEPTED):
    return CommandAcknowledgement(time_s, 1, 1, 511, result, 255)


def attitude(time_s):
    return Attitude(time_s, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def ids(commands):
    return [command.parameters[0] for command in commands]


def settled(streams=STREAMS, time_s=0.0):
    requests = StreamRequests(lambda _: streams)
    requests.update([heartbeat(time_s)], time_s)
    for _ in streams:
        requests.update([answer(time_s)], time_s)
    assert requests.settled
    return requests


def test_silent_until_there_is_an_autopilot():
    requests = StreamRequests(lambda _: STREAMS)
    assert requests.update([], 0.0) == []
    assert not requests.settled


def test_one_request_after_the_other():
    requests = StreamRequests(lambda _: STREAMS)
    (first,) = requests.update([heartbeat(0.0, system_id=7)], 0.0)
    assert (first.command, first.parameters[:2], first.target_system) == (511, (36.0, 50_000.0), 7)
    assert requests.update([heartbeat(0.5)], 0.5)[0].target_system == 1  # another autopilot: from the start
    assert requests.update([], 0.6) == []
    assert ids(requests.update([answer(0.7)], 0.7)) == [11030]
    assert ids(requests.update([answer(0.8, DENIED)], 0.8)) == [226]
    assert requests.update([answer(0.9)], 0.9) == []
    assert requests.settled
    assert (requests.accepted, requests.refused, requests.unanswered) == ({36, 226}, {11030}, set())


def test_three_tries_one_second_apart():
    requests = StreamRequests(lambda _: STREAMS[:1])
    sent = [(0.0, requests.update([heartbeat(0.0)], 0.0)[0].confirmation)]
    for tenth in range(1, 60):
        sent += [(tenth / 10, command.confirmation) for command in requests.update([], tenth / 10)]
    assert sent == [(0.0, 0), (1.0, 1), (2.0, 2)]
    assert requests.unanswered == {36}


def test_an_answer_in_progress_or_not_now_is_waited_for():
    requests = StreamRequests(lambda _: STREAMS[:1])
    requests.update([heartbeat(0.0)], 0.0)
    assert requests.update([answer(0.9, IN_PROGRESS)], 0.9) == []
    assert requests.update([], 1.5) == []
    assert len(requests.update([answer(1.9, TEMPORARILY_REJECTED)], 1.9)) == 1
    assert requests.update([answer(2.0)], 2.0) == []
    assert requests.accepted == {36}


def test_answers_to_other_commands_and_unasked_answers_change_nothing():
    requests = StreamRequests(lambda _: STREAMS)
    requests.update([answer(0.0)], 0.0)
    requests.update([heartbeat(0.0)], 0.0)
    assert requests.update([CommandAcknowledgement(0.1, 1, 1, 176, 0, 255)], 0.1) == []
    assert not requests.accepted


@pytest.mark.parametrize(
    "news",
    [
        [AutopilotReboot(10.0, 1)],
        [heartbeat(10.0)],  # the one before was at 0 s
        [LinkState(10.0, "vehicle", False, "silent"), LinkState(10.0, "vehicle", True, ""), heartbeat(10.0)],
    ],
)
def test_a_restart_starts_over(news):
    requests = settled()
    assert ids(requests.update(news, 10.0)) == [36]
    assert not requests.accepted


def test_a_link_that_is_down_is_not_asked():
    requests = settled()
    assert requests.update([LinkState(1.0, "vehicle", False, "silent")], 60.0) == []


def test_telemetry_that_stops_while_heartbeats_go_on_is_asked_for_again():
    requests = settled()
    asked = []
    for second in range(1, 80):
        readings = [heartbeat(second), *([attitude(second)] if second < 40 else [])]
        asked += [(second, message_id) for message_id in ids(requests.update(readings, float(second)))]
    assert asked[0] == (45, 36)


def test_a_healthy_stream_is_not_asked_for_again():
    requests = settled()
    for second in range(1, 600):
        assert requests.update([heartbeat(second), attitude(second)], float(second)) == []


def test_an_autopilot_that_takes_no_commands_is_asked_every_half_minute():
    requests = StreamRequests(lambda _: STREAMS[:1])
    sent = [second for second in range(70) if requests.update([heartbeat(second)], float(second))]
    assert sent == [0, 1, 2, 30, 31, 32, 60, 61, 62]


@pytest.mark.parametrize("autopilot", [3, 12])
def test_each_kind_of_autopilot_is_asked_for_its_own(autopilot):
    requests = StreamRequests(lambda kind: [Stream(100 + kind, 50.0), Stream(36, 20.0)])
    asked = requests.update([heartbeat(0.0, autopilot=autopilot)], 0.0)
    asked += requests.update([answer(0.0)], 0.0)
    assert ids(asked) == [100 + autopilot, 36]
    assert asked[0].parameters[1] == 20_000


def test_nothing_wanted_is_nothing_asked():
    requests = StreamRequests(lambda _: ())
    assert [requests.update([heartbeat(second)], float(second)) for second in range(100)] == [[]] * 100


def test_streams_that_need_not_come_are_not_missed():
    requests = settled((Stream(2, 1.0), Stream(24, 5.0)))
    for second in range(1, 200):
        assert requests.update([heartbeat(second)], float(second)) == []


def test_a_rate_must_be_positive():
    with pytest.raises(ValueError, match="rate_hz"):
        Stream(30, 0.0)


# What others set down --------------------------------------------------------------------------------


def watched(rates_hz, seconds, requests, heard, start_s):
    """Asked-for ids of each second in which a stream (36) came at the rate of that second, answered at once."""
    asked = []
    for n in range(seconds):
        time_s = start_s + n
        heard[36] += rates_hz(n)
        commands = requests.update([heartbeat(time_s), attitude(time_s)], time_s, heard)
        asked += [(n, *ids(commands))] if commands else []
        if commands:
            requests.update([answer(time_s + 0.01)], time_s + 0.01, heard)
    return asked


def test_a_stream_that_somebody_sets_down_is_asked_for_again_and_ever_more_rarely():
    requests, heard = settled(STREAMS[:1]), Counter()
    assert watched(lambda _: 20, 20, requests, heard, 1.0) == []
    asked = watched(lambda _: 2, 120, requests, heard, 21.0)
    assert all(id_ == 36 for _, id_ in asked)
    pauses = [later - earlier for (earlier, _), (later, _) in itertools.pairwise(asked)]
    assert 0 < asked[0][0] <= 10 and pauses == sorted(pauses) and pauses[-1] >= 40 and len(asked) <= 6


def test_a_stream_that_never_came_as_often_is_not_asked_for_again_and_again():
    requests, heard = settled(STREAMS[:1]), Counter()
    assert watched(lambda _: 4, 100, requests, heard, 1.0) == []


def test_a_stream_that_comes_as_asked_for_is_left_alone():
    requests, heard = settled(STREAMS[:1]), Counter()
    assert watched(lambda n: 20 if n % 3 else 12, 100, requests, heard, 1.0) == []
