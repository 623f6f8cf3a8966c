"""The MAVLink wire with no fault, and with those of its link."""

from __future__ import annotations

from math import inf

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.readings import AutopilotConflict, AutopilotHeartbeat
from hil_tests.scenario.failures import Target, kinds_of
from hil_tests.wires.mavlink_wire import MavlinkWire
from hil_tests.wires.tests.packets import START_S, fault, played
from hil_tests.wires.way import Towards

LINK = Target.LINK
WAYS = (Towards.GATEWAY, Towards.AUTOPILOT)
# Each fault of a link, as bad as it gets, and over before the packets of a test come.
PAST = (
    *(fault(LINK, failure, share=1.0, until_s=5.0) for failure in ("loss", "duplication", "garbage", "bad_checksum")),
    fault(LINK, "reordering", share=1.0, until_s=5.0),
    fault(LINK, "latency", delay_s=1.0, jitter_s=1.0, until_s=5.0),
    fault(LINK, "cut", until_s=5.0),
    fault(LINK, "foreign_system", until_s=5.0),
    fault(LINK, "replay", age_s=1.0, until_s=5.0),
)


def wire(*faults, **options):
    return MavlinkWire(faults, START_S, **options)


def telemetry(count=200, period_s=0.01):
    """(time, packet): heartbeats of one autopilot, each with a number of its own."""
    peer = Peer()
    return [(period_s * n, peer.heartbeat(custom_mode=n)) for n in range(count)]


def numbers_in(packets):
    return [message.custom_mode for message in messages_in(b"".join(packets))]


@settings(max_examples=50)
@given(
    st.lists(st.tuples(st.floats(0.0, 1.0), st.binary(min_size=1, max_size=40), st.sampled_from(WAYS)), max_size=30)
)
def test_without_an_active_fault_all_passes_at_once_the_same_objects_in_their_order(items):
    ours, now_s = wire(*PAST), START_S + 10.0
    ours.due(now_s)
    ours.counts.clear()
    for pause_s, packet, towards in items:
        now_s += pause_s
        ours.put(now_s, packet, towards)
        [passed] = ours.due(now_s)
        assert passed.item is packet
        assert passed.towards is towards
    assert ours.next_s() == inf
    assert not ours.counts


def test_what_came_at_one_time_keeps_its_order_in_both_directions():
    ours = wire()
    ours.put(START_S, b"one", Towards.GATEWAY)
    ours.put(START_S, b"two", Towards.AUTOPILOT)
    ours.put(START_S, b"three", Towards.GATEWAY)
    assert [passed.item for passed in ours.due(START_S)] == [b"one", b"two", b"three"]


def test_a_share_gets_lost_both_ways():
    for towards in WAYS:
        ours = wire(fault(LINK, "loss", share=0.3))
        arrived = played(ours, telemetry(), towards)
        assert len(arrived) == 200 - ours.counts["packets lost"] == pytest.approx(140, abs=25)


def test_two_losses_add_up_as_chances_do():
    arrived = played(wire(fault(LINK, "loss", share=0.5), fault(LINK, "loss", share=0.5)), telemetry(1000))
    assert len(arrived) == pytest.approx(250, abs=50)


def test_a_loss_grows_with_its_ramp():
    arrived = numbers_in(played(wire(fault(LINK, "loss", share=1.0, ramp_s=2.0)), telemetry()))
    early, late = [number for number in arrived if number < 50], [number for number in arrived if number >= 150]
    assert len(early) > 35
    assert len(late) < 15


def test_latency_delays_all_and_jitter_lets_them_overtake():
    ours = wire(fault(LINK, "latency", delay_s=0.5))
    ours.put(START_S, b"early", Towards.GATEWAY)
    assert ours.due(START_S + 0.499) == []
    assert ours.next_s() == START_S + 0.5
    assert [passed.item for passed in ours.due(START_S + 0.5)] == [b"early"]
    assert ours.counts == {"packets delayed": 1}
    shaken = numbers_in(played(wire(fault(LINK, "latency", delay_s=0.5, jitter_s=0.1)), telemetry()))
    assert shaken != sorted(shaken)
    assert sorted(shaken) == list(range(200))


def test_a_share_comes_twice():
    ours = wire(fault(LINK, "duplication", share=0.25))
    arrived = played(ours, telemetry())
    assert len(arrived) == 200 + ours.counts["packets sent twice"] == pytest.approx(250, abs=25)


def test_a_share_is_overtaken():
    ours = wire(fault(LINK, "reordering", share=0.1, held_s=0.05))
    arrived = numbers_in(played(ours, telemetry()))
    assert arrived != sorted(arrived) == list(range(200))
    assert 5 < ours.counts["packets overtaken"] < 40


def test_garbage_follows_packets_and_harms_none():
    ours, decoder = wire(fault(LINK, "garbage", share=0.5)), MavlinkDecoder([])
    arrived = played(ours, telemetry())
    assert len(arrived) == 200 + ours.counts["garbage sent"] == pytest.approx(300, abs=30)
    # a minute of silence later no frame is waited for any more that garbage may have announced
    readings = [*decoder.decode(b"".join(arrived), START_S), *decoder.decode(Peer().attitude(), START_S + 60.0)]
    heard = [reading.custom_mode for reading in readings if isinstance(reading, AutopilotHeartbeat)]
    assert heard == list(range(200))
    assert decoder.drops["bytes outside frames"] > 1000


def test_no_damaged_packet_is_taken_for_a_good_one():
    ours, decoder = wire(fault(LINK, "bad_checksum", share=0.5)), MavlinkDecoder([])
    arrived = played(ours, telemetry())
    damaged = ours.counts["packets damaged"]
    assert damaged == pytest.approx(100, abs=25)
    readings = [reading for packet in arrived for reading in decoder.decode(packet, START_S)]
    readings += decoder.decode(Peer().attitude(), START_S + 60.0)
    heard = [reading.custom_mode for reading in readings if isinstance(reading, AutopilotHeartbeat)]
    assert len(heard) == 200 - damaged
    assert set(heard) < set(range(200))
    assert decoder.drops["checksum"] > 0.7 * damaged


def test_nothing_passes_a_cut_link_either_way():
    ours = wire(fault(LINK, "cut", at_s=0.5, until_s=1.5))
    for at_s, number in ((0.4, b"1"), (0.5, b"2"), (1.49, b"3"), (1.5, b"4")):
        ours.put(START_S + at_s, number, Towards.GATEWAY)
        ours.put(START_S + at_s, number, Towards.AUTOPILOT)
    assert [passed.item for passed in ours.due(START_S + 2.0)] == [b"1", b"1", b"4", b"4"]
    assert ours.counts == {"packets cut off": 4}


def test_a_second_autopilot_is_heard_as_long_as_it_is_there():
    ours = wire(fault(LINK, "foreign_system", system_id=7.0, at_s=1.0, until_s=4.0))
    assert ours.next_s() == START_S + 1.0
    arrived = ours.due(START_S + 60.0)
    messages = messages_in(b"".join(passed.item for passed in arrived))
    assert {passed.towards for passed in arrived} == {Towards.GATEWAY}
    assert {message.get_srcSystem() for message in messages} == {7}
    assert [message.get_type() for message in messages].count("HEARTBEAT") == 3
    assert [message.get_type() for message in messages].count("ATTITUDE") == 30
    assert [message.get_seq() for message in messages] == list(range(33))
    assert ours.next_s() == inf
    assert ours.counts == {"packets of another system": 30}


def test_the_gateway_sees_that_there_are_two_autopilots():
    ours, decoder = wire(fault(LINK, "foreign_system", at_s=0.1)), MavlinkDecoder([])
    for at_s, packet in telemetry(30, 0.1):
        ours.put(START_S + at_s, packet, Towards.GATEWAY)
    readings = [one for passed in ours.due(START_S + 3.0) for one in decoder.decode(passed.item, START_S)]
    assert [one.system_ids for one in readings if isinstance(one, AutopilotConflict)] == [(1, 2)]


def test_old_packets_are_sent_again_the_same_way_while_it_lasts():
    ours = wire(fault(LINK, "replay", age_s=1.0, at_s=0.5, until_s=2.0))
    for at_s, packet in ((-1.0, b"too old"), (0.2, b"early"), (0.9, b"late"), (1.0, b"too late")):
        ours.put(START_S + at_s, packet, Towards.AUTOPILOT)
    assert [passed.item for passed in ours.due(START_S + 1.0)] == [b"too old", b"early", b"late", b"too late"]
    assert ours.next_s() == START_S + 1.2
    arrived = ours.due(START_S + 10.0)
    assert [(passed.item, passed.towards) for passed in arrived] == [
        (b"early", Towards.AUTOPILOT),
        (b"late", Towards.AUTOPILOT),
    ]
    assert ours.counts == {"old packets sent again": 2}


def test_others_on_a_cut_link_are_not_heard_either():
    ours = wire(fault(LINK, "cut"), fault(LINK, "foreign_system", until_s=3.0))
    assert ours.due(START_S + 10.0) == []


@pytest.mark.parametrize("failure", sorted(kinds_of(LINK)))
def test_each_failure_of_the_table_shows_in_what_arrives_and_in_the_counts(failure):
    sizes = {"share": 1.0, "delay_s": 0.3, "age_s": 0.5, "held_s": 0.3}
    needed = {one.name: sizes[one.name] for one in kinds_of(LINK)[failure].quantities if one.name in sizes}
    ours = wire(fault(LINK, failure, at_s=1.0, until_s=1.5, **needed))
    arrived = played(ours, telemetry())
    assert arrived != [packet for _, packet in telemetry()]
    assert sum(ours.counts.values()) > 0


def test_a_mavlink_link_has_two_ends():
    with pytest.raises(ValueError, match=r"towards = Towards.DEVICES: want Towards.AUTOPILOT or Towards.GATEWAY"):
        wire().put(START_S, b"x", Towards.DEVICES)


def test_the_same_seed_does_the_same():
    faults = [fault(LINK, failure, share=0.3) for failure in ("loss", "garbage", "bad_checksum", "duplication")]
    first, second, other = (played(wire(*faults, seed=seed), telemetry()) for seed in (1, 1, 2))
    assert first == second != other
