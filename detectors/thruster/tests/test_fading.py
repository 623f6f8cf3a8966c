import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.thruster.fading import CHUNK, FadingMaximum


def looped(values, decay, level=0.0):
    out = []
    for value in values:
        level = max(value, decay * level)
        out.append(level)
    return np.array(out)


@pytest.mark.parametrize("decay", [0.7788, 0.9, 0.97, 1.0])
def test_equals_the_recursion(decay):
    values = np.random.default_rng(1).exponential(1.0, 3 * CHUNK + 7) ** 6
    np.testing.assert_allclose(FadingMaximum(decay).over(values)[0], looped(values, decay), rtol=1e-12)
    np.testing.assert_allclose(
        FadingMaximum.after(decay, 9e9).over(values)[0], looped(values, decay, 9e9), rtol=1e-12
    )


@given(st.lists(st.integers(0, 2 * CHUNK + 3), max_size=6), st.sampled_from([0.7788, 0.93]))
def test_in_pieces_it_is_the_same_bit_for_bit(cuts, decay):
    values = np.random.default_rng(2).exponential(1.0, 2 * CHUNK + 3) ** 4
    state, levels = FadingMaximum(decay), []
    for part in np.split(values, sorted(cuts)):
        level, state = state.over(part)
        levels.append(level)
    np.testing.assert_array_equal(np.concatenate(levels), FadingMaximum(decay).over(values)[0])


def test_silence_stays_silence():
    levels, state = FadingMaximum(0.8).over(np.zeros(CHUNK + 1))
    assert not levels.any()
    assert state.scaled == 0.0
