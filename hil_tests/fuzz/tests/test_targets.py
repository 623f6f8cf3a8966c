"""Every target, shortly: valid input, input damaged by chance, and damage that hypothesis looks for."""

from __future__ import annotations

from itertools import islice

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hil_tests.fuzz.catalogue import TARGETS
from hil_tests.fuzz.damaging import damaged_inputs, first_failure
from hil_tests.fuzz.mutations import INPUT_MAX, KINDS, Damage

BY_CHANCE, SEARCHED = 30, 15  # inputs of each target: about half a second
SLOW = {"replay": 5}  # one of its inputs costs as much as so many of others

places = st.integers(0, INPUT_MAX)
damages = st.builds(
    Damage, st.integers(0, len(KINDS) - 1), places, places, st.integers(0, 300), st.binary(max_size=16)
)


@pytest.mark.parametrize("name", TARGETS)
def test_stands_what_chance_makes_of_valid_input(name):
    target = TARGETS[name]
    inputs = damaged_inputs(target)
    number = len(target.seeds()) + BY_CHANCE // SLOW.get(name, 1)
    failure = first_failure(target, islice(inputs, number))
    if failure is not None:
        failure.error.add_note(f"input: {failure.data!r}")
        raise failure.error


@pytest.mark.parametrize("name", [name for name in TARGETS if name not in SLOW])
def test_stands_what_is_looked_for(name):
    target = TARGETS[name]
    seeds = [seed[:INPUT_MAX] for seed in target.seeds()]

    @settings(
        max_examples=SEARCHED, deadline=None, derandomize=True, database=None, suppress_health_check=HealthCheck
    )
    @given(st.sampled_from(seeds), st.lists(damages, max_size=6))
    def stands(data, done):
        for one in done:
            data = one.done_to(data)
        target.check(data)

    stands()
