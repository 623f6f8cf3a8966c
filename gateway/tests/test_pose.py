"""The rules of pose.py, one by one, and what must hold for any arrival whatever."""

import math
import pickle
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.speed import PoseSample
from drivers.readings import Attitude, LocalPosition, PositionFix
from gateway.pose import HEADING_PERIOD_S, HOLD_S, PoseAligner
from gateway.position import SILENT_S, PositionTrack
from gateway.thrust import Shares, ThrustDemand

START = LocalPosition(-1.0, (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # a source is alive from its first movement on


def aligner(wanted: str = "local", stale_s: float = 9.0) -> PoseAligner:
    made = PoseAligner(PositionTrack(wanted), ThrustDemand({1: Shares(ahead=0.5, right=-0.5)}, stale_s))
    made.position(START)
    return made


def attitude(time_s: float, heading_deg: float = 0.0, pitch_rad: float = 0.0) -> Attitude:
    return Attitude(time_s, 0.0, pitch_rad, math.radians(heading_deg), 0.0, 0.0, 0.0)


def place(time_s: float, north_m: float | None = None) -> LocalPosition:
    return LocalPosition(time_s, (time_s if north_m is None else north_m, 2.0, 3.0), (0.0, 0.0, 0.0))


def play(made: PoseAligner, readings: list) -> list[PoseSample]:
    samples = []
    for reading in readings:
        samples += made.attitude(reading) if isinstance(reading, Attitude) else made.position(reading)
    return samples


def merged(*streams: list) -> list:
    return sorted((reading for stream in streams for reading in stream), key=lambda reading: reading.time_s)


def times_s(samples: list[PoseSample]) -> list[float]:
    return [sample.time_s for sample in samples]


def test_heading_and_pitch_are_linear_between_the_attitudes_around_the_position():
    readings = [attitude(0.0, 10.0, 0.1), place(0.01), attitude(0.04, 30.0, 0.3)]
    (sample,) = play(aligner(), readings)
    assert sample == PoseSample(0.01, 0.01, 2.0, pytest.approx(math.radians(15.0)), 3.0, pytest.approx(0.15))


@given(st.floats(-720.0, 720.0), st.floats(-170.0, 170.0), st.floats(0.01, 0.99))
def test_the_turn_goes_the_short_way_round(heading_deg, turn_deg, share):
    def wrapped(angle_deg: float) -> float:
        return math.degrees(math.remainder(math.radians(angle_deg), math.tau))

    readings = [
        attitude(0.0, wrapped(heading_deg)),
        place(0.1 * share),
        attitude(0.1, wrapped(heading_deg + turn_deg)),
    ]
    (sample,) = play(aligner(), readings)
    wanted = math.radians(heading_deg + share * turn_deg)
    assert math.remainder(sample.heading_rad - wanted, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert -math.pi <= sample.heading_rad <= math.pi


def test_position_that_comes_with_its_attitude_in_one_packet_does_not_wait():
    made = aligner()
    (sample,) = play(made, [attitude(0.0), attitude(0.05, 40.0), place(0.05)])
    assert sample.heading_rad == pytest.approx(math.radians(40.0))


def test_without_any_attitude_there_is_no_sample():
    made = aligner()
    assert play(made, [place(0.0), place(0.1)]) == []
    assert made.drops == {"position without attitude": 2}


def test_heading_is_held_for_a_while_and_then_not_known():
    made = aligner()
    readings = [attitude(0.0, 20.0), *(place(0.1 * n) for n in range(1, 9))]
    samples = play(made, readings)
    assert times_s(samples) == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5])  # HOLD_S
    assert {sample.heading_rad for sample in samples} == {math.radians(20.0)}
    assert made.drops == {"position without attitude": 3}
    assert times_s(play(made, [attitude(0.85), place(0.87), attitude(0.9)])) == [0.85, 0.87]


def test_attitudes_far_apart_are_not_joined():
    readings = [attitude(0.0, 20.0), place(0.3), attitude(HOLD_S + 0.1, 80.0)]
    (sample,) = play(aligner(), readings)
    assert sample.heading_rad == math.radians(20.0)


def test_positions_that_come_often_enough_are_all_the_samples():
    attitudes = [attitude(0.05 * n + 0.01, n) for n in range(92)]
    samples = play(aligner(), merged(attitudes, [place(0.1 * n + 0.02) for n in range(45)]))
    assert times_s(samples) == pytest.approx([0.1 * n + 0.02 for n in range(45)])


def test_between_rare_positions_there_are_headings():
    attitudes = [attitude(0.05 * n, n) for n in range(200)]
    positions = [place(1.02 * n + 0.03) for n in range(9)]
    samples = play(aligner(), merged(attitudes, positions))
    steps_s = [later - earlier for earlier, later in pairwise(times_s(samples))]
    assert max(steps_s) < HEADING_PERIOD_S + 0.051
    assert {round(sample.north_m, 9) for sample in samples} == {round(one.time_s, 9) for one in positions}
    at_positions = [sample for sample in samples if sample.time_s == sample.north_m]
    assert times_s(at_positions) == [one.time_s for one in positions]
    assert {(one.east_m, one.down_m) for one in samples} == {(2.0, 3.0)}
    assert all(one.heading_rad == pytest.approx(math.radians(20.0 * one.time_s)) for one in samples)


def test_a_place_that_is_too_old_is_not_repeated():
    made = aligner()
    samples = play(made, merged([attitude(0.1 * n) for n in range(200)], [place(0.05)]))
    assert SILENT_S - 0.3 < samples[-1].time_s <= SILENT_S + 0.05


def test_command_is_what_the_thrusters_were_told_since_the_sample_before():
    made = aligner()
    for time_s, fraction in ((-1.0, 0.2), (0.06, -0.6)):
        made.demand.command(time_s, 1, fraction)
    readings = [attitude(0.0), place(0.01), place(0.11), attitude(0.15)]
    first, second = play(made, readings)
    assert (first.command, first.sideways) == (pytest.approx(0.2), pytest.approx(-0.2))
    wanted = -math.sqrt(0.5 * 0.36 - 0.5 * 0.04)
    assert (second.command, second.sideways) == (pytest.approx(wanted), pytest.approx(-wanted))


def test_stale_command_is_not_known():
    made = aligner(stale_s=0.5)
    made.demand.command(-1.0, 1, 0.2)
    (sample,) = play(made, [attitude(0.0), place(0.01), attitude(0.05)])
    assert (sample.command, sample.sideways) == (None, 0.0)


def test_restart_of_the_autopilot_forgets_what_was_half_joined():
    made = aligner()
    assert len(play(made, [attitude(0.0), place(0.1), attitude(0.2), place(0.3)])) == 1
    made.restart()
    assert play(made, [attitude(5.0), attitude(5.1), attitude(5.2), attitude(5.3)]) == []
    assert times_s(play(made, [place(5.35), attitude(5.4)])) == [5.35]


def test_time_running_backwards_is_refused_and_counted():
    made = aligner()
    assert times_s(play(made, [attitude(0.0), attitude(1.0), place(1.01), attitude(1.05)])) == [1.01]
    assert play(made, [attitude(1.05), attitude(0.2), place(0.9), place(1.005, 7.0)]) == []
    assert made.drops == {"attitude time ran backwards": 2, "position time ran backwards": 2}


def test_position_that_another_source_overtook_is_late():
    made = aligner("auto")
    fixes = [PositionFix(float(n), 0.1 + 1e-6 * n, 0.2, 1.0, None, "GPS_INPUT 220.0") for n in range(8)]
    attitudes = [attitude(0.1 * n) for n in range(1, 61)]
    samples = play(made, merged(fixes[:6], attitudes))
    assert times_s(samples)[-1] == pytest.approx(5.8)
    late = PositionFix(5.4, 0.5, 0.2, 1.0, None, "GPS_INPUT 220.0")
    assert play(made, [late]) == []
    assert made.drops["position late"] == 1


any_time = st.floats(0.0, 30.0)
readings = st.lists(
    st.one_of(
        st.builds(attitude, any_time, st.floats(-400.0, 400.0)),
        st.builds(place, any_time),
        st.builds(lambda t: PositionFix(t, t * 1e-6, 0.2, None, None, "GPS_INPUT 220.0"), any_time),
    ),
    max_size=60,
)


@given(readings, st.booleans(), st.sampled_from(["local", "auto"]))
def test_samples_advance_in_time_whatever_arrives(drawn, ordered, wanted):
    samples = play(aligner(wanted), merged(drawn) if ordered else drawn)
    assert all(earlier < later for earlier, later in pairwise(times_s(samples)))
    assert all(math.isfinite(number) for sample in samples for number in (sample.heading_rad, sample.north_m))


@given(readings, st.integers(0, 60))
def test_pickled_and_resumed_goes_on_the_same(drawn, cut):
    drawn = merged(drawn)
    whole, first = aligner(), aligner()
    expected = play(whole, drawn)
    samples = play(first, drawn[:cut])
    resumed = pickle.loads(pickle.dumps(first))  # noqa: S301
    assert repr(samples + play(resumed, drawn[cut:])) == repr(expected)
    assert resumed.drops == whole.drops
