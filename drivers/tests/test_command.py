"""Commands on the wire and as fractions of full thrust."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drivers.command import MAX_OVERSHOOT, CommandScale

PWM = CommandScale(1100.0, 1500.0, 1900.0, dead_band=25.0)
LOPSIDED = CommandScale(1000.0, 1400.0, 2000.0)
ONE_WAY = CommandScale(0.0, 0.0, 100.0)


@pytest.mark.parametrize(
    ("scale", "value", "fraction"),
    [
        (PWM, 1500.0, 0.0),
        (PWM, 1525.0, 0.0),
        (PWM, 1475.0, 0.0),
        (PWM, 1526.0, 0.065),
        (PWM, 1900.0, 1.0),
        (PWM, 1100.0, -1.0),
        (PWM, 1940.0, 1.0),
        (PWM, 1060.0, -1.0),
        (PWM, 1941.0, None),
        (PWM, 1059.0, None),
        (PWM, 0.0, None),
        (PWM, math.nan, None),
        (PWM, math.inf, None),
        (PWM, -math.inf, None),
        (LOPSIDED, 1200.0, -0.5),
        (LOPSIDED, 1700.0, 0.5),
        (ONE_WAY, 0.0, 0.0),
        (ONE_WAY, -4.0, 0.0),
        (ONE_WAY, 50.0, 0.5),
        (ONE_WAY, -6.0, None),
    ],
)
def test_fraction(scale, value, fraction):
    assert scale.fraction(value) == (None if fraction is None else pytest.approx(fraction))


def test_reverse_turns_the_sign_only():
    reverse = CommandScale(1100.0, 1500.0, 1900.0, dead_band=25.0, reverse=True)
    assert reverse.fraction(1900.0) == -1.0
    assert reverse.value(-1.0) == 1900.0


@pytest.mark.parametrize(
    ("minimum", "neutral", "maximum", "dead_band", "message"),
    [
        (1900.0, 1500.0, 1100.0, 0.0, "minimum must be below maximum"),
        (1100.0, 1000.0, 1900.0, 0.0, r"neutral must lie in 1100.0..1900.0, got 1000.0"),
        (1100.0, 1500.0, 1900.0, -1.0, "dead_band must be at least 0"),
        (1100.0, 1500.0, 1900.0, 400.0, "below 400.0, got 400.0"),
        (math.nan, 1500.0, 1900.0, 0.0, "finite"),
        (1100.0, 1500.0, math.inf, 0.0, "finite"),
    ],
)
def test_an_impossible_scale_is_refused(minimum, neutral, maximum, dead_band, message):
    with pytest.raises(ValueError, match=message):
        CommandScale(minimum, neutral, maximum, dead_band)


@pytest.mark.parametrize(("scale", "fraction"), [(PWM, 1.1), (PWM, math.nan), (ONE_WAY, -0.1)])
def test_a_fraction_that_the_scale_does_not_have_is_refused(scale, fraction):
    with pytest.raises(ValueError, match="fraction"):
        scale.value(fraction)


numbers = st.floats(-1e6, 1e6)


@given(st.lists(numbers, min_size=3, max_size=3).map(sorted), st.floats(-1.0, 1.0), st.booleans())
def test_value_is_the_inverse_of_fraction(ends, fraction, reverse):
    minimum, neutral, maximum = ends
    assume(min(neutral - minimum, maximum - neutral) > 1e-3)
    scale = CommandScale(minimum, neutral, maximum, reverse=reverse)
    assert scale.fraction(scale.value(fraction)) == pytest.approx(fraction, abs=1e-6)


@given(st.floats())
def test_any_value_gives_none_or_a_fraction_of_the_right_side(value):
    fraction = PWM.fraction(value)
    span = PWM.maximum - PWM.minimum
    inside = PWM.minimum - MAX_OVERSHOOT * span <= value <= PWM.maximum + MAX_OVERSHOOT * span
    assert (fraction is not None) == inside
    if fraction:
        assert -1.0 <= fraction <= 1.0
        assert (fraction > 0.0) == (value > PWM.neutral)


@given(
    st.lists(
        st.floats() | st.floats(900.0, 2200.0) | st.sampled_from([1100.0, 1475.0, 1525.0, 1900.0, -0.0]), max_size=9
    ),
    st.sampled_from([PWM, LOPSIDED, ONE_WAY]),
    st.booleans(),
)
def test_many_values_give_what_each_gives_alone(values, scale, reverse):
    scale = replace(scale, reverse=reverse)
    alone = [math.nan if (fraction := scale.fraction(value)) is None else fraction for value in values]
    assert scale.fractions(np.array(values)).tobytes() == np.array(alone).tobytes()
