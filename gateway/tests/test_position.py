"""The rules of position.py: which source is chosen, in which frame, and what is refused."""

import math
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.readings import GlobalPosition, LocalPosition, PositionFix
from gateway.local_frame import LocalFrame
from gateway.position import CHOICE_S, FAR_M, SILENT_S, Place, PositionTrack

REST = (0.0, 0.0, 0.0)
HOME = LocalFrame.at_degrees(63.46, 10.38)


def local(time_s: float, north_m: float, east_m: float = 0.0, down_m: float = 5.0) -> LocalPosition:
    return LocalPosition(time_s, (north_m, east_m, down_m), REST)


def earth(time_s: float, north_m: float, frame: LocalFrame = HOME, depth_m: float = 7.0) -> GlobalPosition:
    return GlobalPosition(time_s, *map(math.radians, frame.degrees(north_m, 0.0)), depth_m, REST)


def fix(time_s: float, north_m: float, source: str = "GPS_INPUT 220.0", depth_m: float | None = None) -> PositionFix:
    return PositionFix(time_s, *map(math.radians, HOME.degrees(north_m, 0.0)), depth_m, None, source)


def play(track: PositionTrack, readings: list) -> list[Place]:
    return [place for reading in readings if (place := track.take(reading)) is not None]


def merged(*streams: list) -> list:
    return sorted((reading for stream in streams for reading in stream), key=lambda reading: reading.time_s)


def moving(make, until_s: float, period_s: float = 0.5, **fields) -> list:
    times_s = [n * period_s for n in range(int(until_s / period_s) + 1)]
    return [make(time_s, 1.0 + 0.4 * time_s, **fields) for time_s in times_s]


def test_local_position_is_taken_as_it_is_from_its_first_movement_on():
    track = PositionTrack("local")
    assert play(track, [local(0.0, 3.0, 4.0), local(0.1, 3.5, 4.25, 6.0)]) == [Place(0.1, 3.5, 4.25, 6.0)]
    assert track.source == "LOCAL_POSITION_NED"
    assert track.drops == {}


def test_the_best_source_that_moves_is_chosen_after_a_while():
    track = PositionTrack()
    streams = merged(moving(earth, 6.0), moving(local, 6.0, period_s=0.1), moving(fix, 6.0, period_s=1.0))
    places = play(track, streams)
    assert track.source == "GPS_INPUT 220.0"
    assert places[0].time_s >= CHOICE_S + 0.1
    assert [place.time_s for place in places] == [4.0, 5.0, 6.0]


@pytest.mark.parametrize(
    ("makes", "source"),
    [((earth, local), "LOCAL_POSITION_NED"), ((earth,), "GLOBAL_POSITION_INT"), ((earth, fix), "GPS_INPUT 220.0")],
)
def test_order_of_the_sources(makes, source):
    track = PositionTrack()
    play(track, merged(*(moving(make, 5.0) for make in makes)))
    assert track.source == source


def test_acoustic_system_goes_before_the_receiver_that_echoes_it():
    track = PositionTrack("fix")
    play(track, merged(moving(fix, 1.0, source="GPS_RAW_INT")))
    assert track.source == "GPS_RAW_INT"  # it is alone so far, and stays
    track = PositionTrack()
    play(track, merged(moving(fix, 5.0, source="GPS_RAW_INT"), moving(fix, 5.0)))
    assert track.source == "GPS_INPUT 220.0"


def test_a_system_that_says_the_same_place_for_ever_is_not_alive():
    track = PositionTrack()
    stuck = [fix(0.25 * n, 10.0) for n in range(80)]
    places = play(track, merged(stuck, moving(local, 20.0)))
    assert track.source == "LOCAL_POSITION_NED" and len(places) > 30
    assert track.drops == {"position repeated": 79}


def test_source_is_kept_until_it_falls_silent_and_then_the_next_one_goes_on():
    track = PositionTrack()
    places = play(track, merged(moving(fix, 6.0, period_s=1.0), moving(local, 30.0)))
    assert [place.time_s for place in places[:3]] == [4.0, 5.0, 6.0]
    assert places[3].time_s == pytest.approx(6.0 + SILENT_S, abs=0.6)
    assert track.source == "LOCAL_POSITION_NED"
    assert track.drops == {"position source silent": 1}
    later = [fix(30.0 + n, 50.0 + n) for n in range(5)]
    assert play(track, merged(later, [local(30.1 + n, 60.0 + n) for n in range(5)]))[-1].north_m == 64.0


@pytest.mark.parametrize(
    ("wanted", "makes"), [("local", (earth, fix)), ("global", (local, fix)), ("fix", (earth, local))]
)
def test_only_what_is_configured_is_listened_to(wanted, makes):
    track = PositionTrack(wanted)
    assert play(track, merged(*(moving(make, 9.0) for make in makes))) == []
    assert not any(track.wants(make(0.0, 0.0)) for make in makes)
    assert track.drops == {}


def test_positions_on_the_earth_are_metres_from_the_first():
    track = PositionTrack("global")
    places = play(track, [earth(0.0, 100.0), earth(0.1, 101.0), earth(0.2, 103.0)])
    assert [place.north_m for place in places] == pytest.approx([0.0, 2.0], abs=1e-3)
    assert [place.down_m for place in places] == [7.0, 7.0]


def test_positions_on_the_earth_are_metres_from_the_configured_origin():
    track = PositionTrack("global", HOME)
    (place,) = play(track, [earth(0.0, 100.0), earth(0.1, 101.0)])
    assert place.north_m == pytest.approx(101.0, abs=1e-3)
    assert play(track, [earth(0.2, 100.0, LocalFrame.at_degrees(-63.46, 10.38))]) == []
    assert play(track, [earth(0.3, FAR_M + 100.0)]) == []
    assert track.drops == {"position far from the origin": 2}


def test_far_from_the_first_a_new_origin_is_taken():
    track = PositionTrack("global")
    far = [earth(0.2 + 0.1 * n, FAR_M + 1000.0 + n) for n in range(3)]
    places = play(track, [earth(0.0, 0.0), earth(0.1, 1.0), *far])
    assert [place.north_m for place in places] == pytest.approx([0.0, 0.0, 1.0, 2.0], abs=0.01)
    assert track.drops == {}


def test_depth_of_a_fix_is_the_autopilots():
    track = PositionTrack("fix")
    assert play(track, [fix(0.0, 0.0), fix(1.0, 1.0)])[0].down_m == 0.0
    assert play(track, [fix(2.0, 2.0, depth_m=3.0)])[0].down_m == 3.0
    assert play(track, [earth(2.1, 0.0, depth_m=8.0), fix(3.0, 3.0, depth_m=0.0)])[0].down_m == 8.0


@given(st.floats(-80.0, 80.0), st.floats(-0.01, 0.01))
def test_across_the_date_line_nothing_jumps(latitude_deg, east_deg):
    track = PositionTrack("global")
    longitudes_deg = [180.0 - 0.002, 180.0 - 0.001 if east_deg < 0 else -180.0 + 0.001, -180.0 + 0.003]
    readings = [
        GlobalPosition(float(n), math.radians(latitude_deg), math.radians(longitude_deg), 0.0, REST)
        for n, longitude_deg in enumerate(longitudes_deg)
    ]
    first, second = play(track, readings)
    assert (first.north_m, first.east_m) == (0.0, 0.0)
    assert 0.0 < second.east_m < 500.0 and abs(second.north_m) < 1.0


def test_time_running_backwards_is_refused_and_counted():
    track = PositionTrack("local")
    play(track, [local(1.0, 1.0), local(1.1, 2.0)])
    assert play(track, [local(1.1, 3.0), local(0.5, 3.0)]) == []
    assert track.drops == {"position time ran backwards": 2}


@pytest.mark.parametrize("arguments", [("usbl",), ("local", HOME)])
def test_wrong_argument_is_named(arguments):
    with pytest.raises(ValueError, match="wanted"):
        PositionTrack(*arguments)


kinds = st.sampled_from([local, earth, fix, lambda t, n: fix(t, n, "GPS_RAW_INT")])
events = st.lists(st.tuples(kinds, st.floats(0.0, 60.0), st.floats(-2e5, 2e5)), max_size=60)


@given(events, st.integers(0, 60), st.sampled_from(["auto", "local", "global", "fix"]))
def test_pickled_and_resumed_goes_on_the_same(drawn, cut, wanted):
    readings = [make(time_s, north_m) for make, time_s, north_m in sorted(drawn, key=lambda one: one[1])]
    whole, first = PositionTrack(wanted), PositionTrack(wanted)
    expected = play(whole, readings)
    places = play(first, readings[:cut])
    resumed = pickle.loads(pickle.dumps(first))  # noqa: S301
    assert repr(places + play(resumed, readings[cut:])) == repr(expected)
    assert resumed.drops == whole.drops
