"""What operators call the subjects."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.config import parse
from gateway.control.subject_words import subjects_named, wanted, watched_subjects
from gateway.operator import code_of
from gateway.tests.conftest import NAVIGATION_WATCH, SPEED_WATCH, TWO_THRUSTERS

ALL_WATCHED = (
    *("thruster 1", "thruster 2", "thruster 12", "vehicle"),
    *("dvl", "depth sensor", "gyroscope", "accelerometer", "navigation"),
)


@pytest.mark.parametrize(
    ("words", "subjects"),
    [
        ("T1", ["thruster 1"]),
        ("t12", ["thruster 12"]),
        ("2", ["thruster 2"]),
        ("thruster 2", ["thruster 2"]),
        ("Thruster2", ["thruster 2"]),
        ("T01", ["thruster 1"]),
        ("speed", ["vehicle"]),
        ("vehicle", ["vehicle"]),
        ("DVL", ["dvl"]),
        ("depth", ["depth sensor"]),
        ("depth sensor", ["depth sensor"]),
        ("gyro accel nav", ["gyroscope", "accelerometer", "navigation"]),
        ("all", ["all"]),
        ("T1 T2 dvl", ["thruster 1", "thruster 2", "dvl"]),
        ("T1, T2,speed", ["thruster 1", "thruster 2", "vehicle"]),
        ("thruster 1 thruster 2", ["thruster 1", "thruster 2"]),
        ("T1 T1 1", ["thruster 1"]),
        ("", []),
    ],
)
def test_words_of_operators(words, subjects):
    assert subjects_named(words.split(" "), ALL_WATCHED) == subjects
    assert subjects_named([words], ALL_WATCHED) == subjects
    assert all(code_of(subject) >= 0 for subject in subjects)


@pytest.mark.parametrize(
    "words", ["T3", "thruster", "T", "T123", "sonar", "dvl2", "depthsensor", "T1x", "-1", "T1 sonar"]
)
def test_what_is_not_there_is_answered_with_what_is(words):
    with pytest.raises(
        ValueError, match=r"want T1, T2, T12, speed, dvl, depth sensor, gyroscope, .*, navigation, or all"
    ):
        subjects_named(words.split(), ALL_WATCHED)


def test_what_is_not_watched_has_no_name():
    with pytest.raises(ValueError, match="subject 'speed': want T1, or all"):
        subjects_named(["speed"], ["thruster 1"])
    with pytest.raises(ValueError, match="subject 'dvl'"):
        subjects_named(["T1", "dvl"], ["thruster 1"])


@given(st.lists(st.text(max_size=12), max_size=4))
def test_whatever_is_typed_is_a_subject_or_an_error(words):
    try:
        subjects = subjects_named(words, ALL_WATCHED)
    except ValueError as error:
        assert wanted(ALL_WATCHED) in str(error)
    else:
        assert set(subjects) <= {*ALL_WATCHED, "all"}


def test_what_is_watched_is_in_the_configuration():
    folder = Path("/nowhere")
    assert watched_subjects(parse(TWO_THRUSTERS, folder)) == ("thruster 1", "thruster 2")
    assert watched_subjects(parse(TWO_THRUSTERS + SPEED_WATCH, folder))[2:] == ("vehicle",)
    sensors = watched_subjects(parse(TWO_THRUSTERS + NAVIGATION_WATCH, folder))[2:]
    assert sensors == ("dvl", "depth sensor", "gyroscope", "accelerometer", "navigation")
