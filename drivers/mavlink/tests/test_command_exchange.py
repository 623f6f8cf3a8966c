"""The MAVLink command protocol: who answers what, how often it is sent, and when it is over."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.command_exchange import (
    ANSWER_S,
    NO_ANSWER,
    PROGRESS_MAX_S,
    RESULT_WORDS,
    TRIES,
    CommandExchange,
    Ended,
)
from drivers.mavlink.messages import CommandLong
from drivers.readings import CommandAcknowledgement

HOLD = CommandLong(176, (1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0), 7, 1)
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS, CANCELLED = range(7)


def answer(time_s: float, result: int, command: int = 176, system: int = 7, component: int = 1):
    return CommandAcknowledgement(time_s, system, component, command, result, 255)


def test_it_is_sent_again_twice_with_its_confirmation_raised_and_then_it_is_over():
    exchange = CommandExchange(HOLD, 10.0)
    sent = [exchange.advance(10.0 + tenths / 10) for tenths in range(60)]
    again = {tenths: one for tenths, one in enumerate(sent) if one is not None}
    assert {tenths: one.confirmation for tenths, one in again.items()} == {10: 1, 20: 2}
    assert {one.parameters for one in again.values()} == {HOLD.parameters}
    assert (exchange.ended, exchange.word) == (Ended.UNANSWERED, NO_ANSWER)


@pytest.mark.parametrize(
    ("result", "ended", "word"),
    [
        (ACCEPTED, Ended.ACCEPTED, "accepted"),
        (DENIED, Ended.REFUSED, "denied"),
        (UNSUPPORTED, Ended.REFUSED, "unsupported"),
        (FAILED, Ended.REFUSED, "failed"),
        (CANCELLED, Ended.REFUSED, "cancelled"),
        (99, Ended.REFUSED, "result 99"),
    ],
)
def test_a_final_answer_ends_it(result, ended, word):
    exchange = CommandExchange(HOLD, 10.0)
    exchange.acknowledge(answer(10.2, result))
    assert (exchange.ended, exchange.word) == (ended, word)
    assert exchange.advance(20.0) is None


def test_rejected_for_now_is_tried_again_and_in_the_end_refused():
    exchange = CommandExchange(HOLD, 0.0)
    exchange.acknowledge(answer(0.1, TEMPORARILY_REJECTED))
    assert exchange.advance(0.5) is None  # not at once: it would be rejected again
    assert exchange.advance(1.0).confirmation == 1
    exchange.acknowledge(answer(1.1, TEMPORARILY_REJECTED))
    assert exchange.advance(2.0).confirmation == 2
    assert exchange.advance(3.0) is None
    assert (exchange.ended, exchange.word) == (Ended.REFUSED, "rejected for now")


def test_in_progress_extends_the_wait():
    exchange = CommandExchange(HOLD, 0.0)
    for time_s in (0.9, 1.8, 2.7):
        exchange.acknowledge(answer(time_s, IN_PROGRESS))
        assert exchange.advance(time_s + 0.9 * ANSWER_S) is None
    exchange.acknowledge(answer(3.6, ACCEPTED))
    assert exchange.ended is Ended.ACCEPTED


def test_in_progress_for_ever_is_no_answer():
    exchange = CommandExchange(HOLD, 0.0)
    time_s = 0.0
    while exchange.ended is None and time_s < 2 * PROGRESS_MAX_S:
        time_s += 0.5
        exchange.acknowledge(answer(time_s, IN_PROGRESS))
        assert exchange.advance(time_s) is None
    assert exchange.ended is Ended.UNANSWERED
    assert time_s == PROGRESS_MAX_S


@pytest.mark.parametrize("other", [{"command": 400}, {"system": 8}, {"component": 191}])
def test_answers_to_others_and_from_others_mean_nothing(other):
    exchange = CommandExchange(HOLD, 0.0)
    exchange.acknowledge(answer(0.1, ACCEPTED, **other))
    assert not exchange.answers(answer(0.1, ACCEPTED, **other))
    assert exchange.ended is None
    assert exchange.advance(1.0).confirmation == 1


def test_an_answer_after_the_end_changes_nothing():
    exchange = CommandExchange(HOLD, 0.0)
    exchange.acknowledge(answer(0.1, DENIED))
    exchange.acknowledge(answer(0.2, ACCEPTED))
    assert exchange.ended is Ended.REFUSED


def test_every_result_has_its_word_but_in_progress_which_is_none():
    assert set(RESULT_WORDS) == set(range(7)) - {IN_PROGRESS}


@given(st.lists(st.tuples(st.floats(0.0, 2.0), st.none() | st.integers(0, 8)), max_size=80))
def test_whatever_comes_it_is_sent_three_times_at_most_and_ends(steps):
    exchange, time_s, sent = CommandExchange(HOLD, 0.0), 0.0, [HOLD]
    for after_s, result in steps:
        time_s += after_s
        if result is not None:
            exchange.acknowledge(answer(time_s, result))
        again = exchange.advance(time_s)
        assert again is None or exchange.ended is None
        sent += [] if again is None else [again]
    for _ in range(TRIES):
        time_s += PROGRESS_MAX_S
        again = exchange.advance(time_s)
        sent += [] if again is None else [again]
    assert [one.confirmation for one in sent] == list(range(len(sent)))
    assert len(sent) <= TRIES
    assert exchange.ended is not None


# Answers to the exchange before -----------------------------------------------------------------------


def test_late_answers_to_the_exchange_before_are_let_pass():
    before = CommandExchange(HOLD, 0.0)
    again = before.advance(1.0)
    before.acknowledge(answer(1.1, DENIED))  # to the first try; the second is still owed
    assert again is not None and before.ended is Ended.REFUSED and before.owed == 1
    now = CommandExchange(HOLD, 1.2, before)
    now.acknowledge(answer(1.3, DENIED))
    assert now.ended is None
    now.acknowledge(answer(1.4, ACCEPTED))
    assert now.ended is Ended.ACCEPTED


def test_of_another_command_or_long_ago_nothing_is_owed():
    before = CommandExchange(HOLD, 0.0)
    other = CommandExchange(replace(HOLD, command=400), 0.1, before)
    assert not other.answers(answer(0.2, ACCEPTED))
    later = CommandExchange(HOLD, 5.0, before)
    later.acknowledge(answer(6.5, ACCEPTED))
    assert later.ended is Ended.ACCEPTED
