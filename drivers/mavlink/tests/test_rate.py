"""So many in a second and no more."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.rate import RateLimit


@given(st.integers(1, 5), st.lists(st.floats(0.0, 10.0), max_size=60).map(sorted))
def test_no_second_sees_more_and_none_is_refused_without_need(most, times_s):
    limit, admitted_s = RateLimit(most), []
    for time_s in times_s:
        lately = sum(time_s - before_s < 1.0 for before_s in admitted_s)
        assert limit.admits(time_s) == (lately < most)
        if lately < most:
            admitted_s.append(time_s)


def test_at_least_one_a_second():
    with pytest.raises(ValueError, match="per_second must be at least 1, got 0"):
        RateLimit(0)
