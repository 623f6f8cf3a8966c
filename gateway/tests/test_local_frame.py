"""The local frame against PROJ, and what must hold wherever a vehicle dives."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.local_frame import LocalFrame

# Computed with PROJ 9 (pyproj): +proj=topocentric for north and east, its geodesics for distance and azimuth.
#   origin           place             north m             east m             distance m          azimuth deg
PROJ = [
    ((54.5, 10.2), (54.5432, 10.3), 4813.392288031578, 6471.906637397554, 8065.6280239487805, 53.36047700084285),
    ((0.0, 179.98), (0.05, -179.95), 5528.713103446548, 7792.359469768416, 9554.45463007533, 54.64413253687085),
    ((-77.85, 166.7), (-77.8, 166.4), 5564.067821886795, -7080.014524746087, 9004.749299043606, -51.83677321521695),
    (
        (89.999, 30.0),
        (89.98, -120.0),
        2046.290407332119,
        -1116.9397724501728,
        2331.2784318540557,
        -28.627318488270443,
    ),
    ((-33.9, -20.0), (-33.85, -20.08), 5543.1229413111305, -7403.746005599554, 9248.877061088586, -53.17810808807829),
]

latitudes = st.floats(-90, 90)
longitudes = st.floats(-180, 180)
offsets = st.floats(-50_000, 50_000)


def metres(origin, place) -> tuple[float, float]:
    return LocalFrame.at_degrees(*origin).metres(*map(math.radians, place))


@pytest.mark.parametrize(("origin", "place", "north", "east", "distance", "azimuth"), PROJ)
def test_as_proj_has_it(origin, place, north, east, distance, azimuth):
    assert metres(origin, place) == pytest.approx((north, east), abs=1e-6)
    assert math.hypot(*metres(origin, place)) == pytest.approx(distance, abs=0.005)
    assert math.degrees(math.atan2(east, north)) == pytest.approx(azimuth, abs=1e-3)


@given(latitudes, longitudes, offsets, offsets)
def test_way_back_is_exact_everywhere(latitude, longitude, north, east):
    frame = LocalFrame.at_degrees(latitude, longitude)
    place = frame.degrees(north, east)
    assert -180 <= place[1] < 180
    assert frame.metres(*map(math.radians, place)) == pytest.approx((north, east), abs=1e-6)


@given(latitudes, longitudes, st.integers(-2, 2), st.integers(-2, 2))
def test_turns_of_longitude_make_no_difference(latitude, longitude, turns, origin_turns):
    here = metres((latitude, longitude), (latitude, longitude))
    turned = metres((latitude, longitude + 360 * origin_turns), (latitude, longitude + 360 * turns))
    assert turned == pytest.approx(here, abs=1e-6)
    assert here == pytest.approx((0.0, 0.0), abs=1e-6)


def test_no_metres_to_the_other_side_of_the_earth_and_no_place_beside_it():
    assert all(map(math.isnan, metres((10, 20), (-10, -160))))
    assert all(map(math.isnan, LocalFrame(0.3, 0.4).degrees(0.0, 6.4e6)))


@pytest.mark.parametrize(
    ("latitude", "longitude", "named"),
    [(1.6, 0.0, "latitude_rad = 1.6"), (math.nan, 0.0, "latitude_rad = nan"), (0.0, math.inf, "longitude_rad = inf")],
)
def test_origin_that_is_no_place_is_refused(latitude, longitude, named):
    with pytest.raises(ValueError, match=named):
        LocalFrame(latitude, longitude)
