"""A CAN wire with faults of frames: transparent without, and each row of the table with what it says."""

from __future__ import annotations

from math import inf

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.can.error_frame import BusCondition, condition
from drivers.can.frame import CanFrame
from hil_tests.scenario.failures import Target, kinds_of
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.can_wire import CanWire
from hil_tests.wires.tests.can_traffic import BUS, START_S, every, fault, passed, since_s, until, wire
from hil_tests.wires.way import Towards

LATER = [
    fault("loss", at_s=100.0, share=1.0),
    fault("bus_off", at_s=101.0),
    fault("babbling", at_s=102.0),
    fault("delay", at_s=0.0, until_s=0.5, delay_s=0.1),
    fault("corruption", "can1", share=1.0),
]
ITEMS = st.lists(
    st.tuples(
        st.floats(0.0, 0.2),
        st.sampled_from([Towards.AUTOPILOT, Towards.DEVICES]),
        st.binary(max_size=8),
        st.booleans(),
    ),
    max_size=30,
)


@settings(max_examples=60, deadline=None)
@given(items=ITEMS, ask_each=st.booleans())
def test_with_no_fault_active_it_is_transparent(
    items: list[tuple[float, Towards, bytes, bool]], ask_each: bool
) -> None:
    through = wire(*LATER)
    put, arrived, time_s = [], [], START_S + 1.0
    for gap_s, towards, data, extended in items:
        time_s += gap_s
        frame = CanFrame(time_s, 0x123, data, extended)
        put.append((frame, towards))
        through.put(time_s, frame, towards)
        if ask_each:
            assert through.next_s() == time_s
            arrived += through.due(time_s)
    arrived += through.due(time_s)
    assert [(one.item, one.towards) for one in arrived] == put
    assert all(one.item is frame for one, (frame, _) in zip(arrived, put, strict=True))
    assert not through.counts


def test_a_fault_leaves_what_comes_before_and_after_it_alone() -> None:
    frames = every(0.1, 100)
    arrived = passed(wire(fault("loss", at_s=3.0, until_s=6.0, share=1.0)), frames)
    assert [frame.data[1] for frame in arrived] == [*range(30), *range(60, 100)]
    assert all(frame in frames for frame in arrived)


def test_loss_takes_its_share_of_each_direction_and_only_of_its_node() -> None:
    of_node, of_others = every(0.01, 1000, 0x1234_5605), every(0.01, 1000, 0x1234_5606)
    through = wire(fault("loss", share=0.3, node=5))
    assert 620 < len(passed(through, of_node)) < 780
    assert passed(wire(fault("loss", share=0.3, node=5)), of_others) == of_others
    assert 620 < len(passed(wire(fault("loss", share=0.3)), of_node, Towards.DEVICES)) < 780


def test_a_ramp_lets_the_share_grow() -> None:
    arrived = passed(wire(fault("loss", share=1.0, ramp_s=10.0)), every(0.01, 1500))
    lost_by_s = [1.0 - sum(n <= since < n + 1 for since in since_s(arrived)) / 100.0 for n in range(15)]
    assert lost_by_s[0] < 0.15
    assert 0.3 < lost_by_s[5] < 0.8
    assert lost_by_s[10:] == [1.0] * 5


def test_corruption_flips_one_bit_to_three() -> None:
    frames = every(0.01, 400)
    through = wire(fault("corruption", share=0.5))
    arrived = passed(through, frames)
    flipped = [
        (int.from_bytes(one.data, "big") ^ int.from_bytes(other.data, "big")).bit_count()
        for one, other in zip(frames, arrived, strict=True)
    ]
    assert set(flipped) == {0, 1, 2, 3}
    assert through.counts["frames corrupted"] == sum(bits > 0 for bits in flipped)
    assert 150 < through.counts["frames corrupted"] < 250
    empty = every(0.01, 5, data=b"")
    assert passed(wire(fault("corruption", share=1.0)), empty) == empty


def test_duplication_says_it_twice_at_once() -> None:
    frames = every(0.01, 3)
    assert passed(wire(fault("duplication", share=1.0)), frames) == [frame for frame in frames for _ in range(2)]


def test_reordering_lets_others_overtake() -> None:
    through = wire(fault("reordering", share=0.2, held_s=0.025))
    frames = every(0.01, 200)
    arrived = passed(through, frames)
    assert sorted(frame.data for frame in arrived) == [frame.data for frame in frames]
    assert [frame.data for frame in arrived] != [frame.data for frame in frames]
    assert since_s(arrived) == sorted(since_s(arrived))
    late_s = {frame.data: since for frame, since in zip(arrived, since_s(arrived), strict=True)}
    held = [n for n, frame in enumerate(frames) if late_s[frame.data] - 0.01 * n > 0.001]
    assert len(held) == through.counts["frames held back"]
    assert all(late_s[frames[n].data] == pytest.approx(0.01 * n + 0.025, abs=1e-6) for n in held)


def test_delay_keeps_the_order_and_stamps_with_the_arrival() -> None:
    frames = every(0.01, 300)
    arrived = passed(wire(fault("delay", delay_s=0.2, jitter_s=0.1)), frames)
    assert [frame.data for frame in arrived] == [frame.data for frame in frames]
    late_s = [after - before for before, after in zip(since_s(frames), since_s(arrived), strict=True)]
    assert min(late_s) >= 0.2 - 1e-6
    assert 0.25 < max(late_s) <= 0.3 + 1e-6
    assert since_s(arrived) == sorted(since_s(arrived))


@pytest.mark.parametrize("length", [0, 5, 8])
def test_wrong_dlc_cuts_or_fills_up(length: int) -> None:
    through = wire(fault("wrong_dlc", share=1.0))
    arrived = passed(through, every(0.01, 300, data=b"12345678"[:length]))
    assert {len(frame.data) for frame in arrived} == set(range(9)) - {length}
    assert all(b"12345678\0\0\0\0"[2 : len(frame.data)] in frame.data or length < 8 for frame in arrived)
    assert through.counts["frames of a wrong length"] == 300


def test_wrong_dlc_of_can_fd_has_a_length_that_a_dlc_can_tell() -> None:
    frames = [CanFrame(START_S + 0.01 * n, 1, bytes(12), fd=True) for n in range(300)]
    lengths = {len(frame.data) for frame in passed(wire(fault("wrong_dlc", share=1.0)), frames)}
    assert lengths == {*range(9), 16, 20, 24, 32, 48, 64}


def test_bus_off_is_told_as_the_kernel_does_and_no_report_passes_until_its_end() -> None:
    through = wire(fault("bus_off", at_s=1.0, until_s=2.0))
    arrived = passed(through, every(0.1, 30))
    errors = [frame for frame in arrived if frame.error]
    assert [condition(frame) for frame in errors] == [BusCondition.BUS_OFF, BusCondition.RESTARTED]
    assert since_s(errors) == [1.0, 2.0]
    assert [frame.data[1] for frame in arrived if not frame.error] == [*range(10), *range(20, 30)]
    assert through.counts == {"frames lost while bus-off": 10}


def test_bus_off_of_the_gateway_keeps_no_command_from_the_escs() -> None:
    through, commands = wire(fault("bus_off", at_s=1.0, until_s=2.0)), every(0.1, 30)
    assert passed(through, commands, Towards.DEVICES) == commands
    assert [through.bus_off(START_S + since_s) for since_s in (0.9, 1.0, 1.9, 2.0)] == [False, True, True, False]


def test_a_babbler_with_the_best_identifier_drives_all_others_out_once_the_bus_is_full() -> None:
    through = wire(fault("babbling", at_s=1.0, until_s=2.0, frames_per_s=20000.0))
    arrived = passed(through, every(0.01, 300))
    babbled, others = [one for one in arrived if not one.identifier], [one for one in arrived if one.identifier]
    assert len(babbled) == pytest.approx(7200, rel=0.05)  # eight bytes of data: 138 us each
    assert not [since for since in since_s(others) if 1.001 < since < 2.0]
    assert len(others) == pytest.approx(200, abs=3)
    assert through.counts["frames driven out by babbling"] == 300 - len(others)


def test_a_babbler_that_leaves_room_only_delays() -> None:
    frames = every(0.01, 100)
    through = wire(fault("babbling", frames_per_s=5000.0))
    others = [one for one in passed(through, frames, rest_s=0.03) if one.identifier]
    assert [one.data for one in others] == [one.data for one in frames]
    late_s = [after - before for before, after in zip(since_s(frames), since_s(others), strict=True)]
    assert min(late_s) > 0.0001
    assert max(late_s) < 0.001


def test_what_has_more_priority_than_the_babbler_waits_for_one_frame_at_most() -> None:
    through = wire(fault("babbling", frames_per_s=20000.0, identifier=0x1000))
    better, worse = every(0.0015, 100, 0x0FFF), every(0.0015, 100, 0x1001)
    arrived = [one for one in passed(through, better, rest_s=0.03) if one.identifier == 0x0FFF]
    late_s = [after - before for before, after in zip(since_s(better), since_s(arrived), strict=True)]
    assert max(late_s) < 2 * 145e-6
    through = wire(fault("babbling", frames_per_s=20000.0, identifier=0x1000))
    assert not [one for one in passed(through, worse, rest_s=0.03) if one.identifier == 0x1001]


def test_a_short_identifier_wins_against_a_long_one_that_begins_with_it() -> None:
    through = wire(fault("babbling", frames_per_s=20000.0, identifier=float(0x123 << 18)))
    standard = [CanFrame(START_S + 0.01 * n, 0x123, bytes(2), extended=False) for n in range(50)]
    assert len([one for one in passed(through, standard, rest_s=0.03) if not one.extended]) == 50


def test_a_babbler_is_heard_at_both_ends() -> None:
    through = wire(fault("babbling", frames_per_s=1000.0))
    heard = until(through, START_S + 0.1)
    assert [sum(one.towards is end for one in heard) for end in (Towards.AUTOPILOT, Towards.DEVICES)] == [100, 100]
    assert not [one for one in heard if one.towards is Towards.GATEWAY]


@pytest.mark.parametrize("failure", ["loss", "corruption", "duplication", "reordering", "wrong_dlc"])
def test_chance_comes_again_with_the_seed(failure: str) -> None:
    frames = every(0.01, 100)
    first, again, other = (passed(wire(fault(failure, share=0.5), seed=seed), frames) for seed in (1, 1, 2))
    assert first == again != other


def test_two_faults_of_one_kind_draw_their_own_chance() -> None:
    arrived = passed(wire(fault("loss", share=0.5), fault("loss", share=0.5)), every(0.01, 1000))
    assert 200 < len(arrived) < 300


def test_every_failure_of_a_bus_in_the_table_does_something() -> None:
    for failure, row in kinds_of(Target.BUS).items():
        if failure == "node_conflict":
            continue
        needed = {one.name: 0.5 for one in row.quantities if one.default is None}
        frames = every(0.01, 50)
        assert passed(wire(fault(failure, **needed)), frames) != frames, failure


def test_a_node_on_a_bus_without_node_ids_is_refused() -> None:
    with pytest.raises(ValueError, match=r"node = 5 of can0 loss: leave it out, frames of a dbc bus tell no node"):
        CanWire(BUS, CanSignals(protocol="dbc"), [fault("loss", share=0.5, node=5)], START_S)


def test_nothing_more_is_due_of_a_quiet_wire() -> None:
    assert wire().next_s() == inf
    assert wire().due(START_S) == []
