"""The user's file is what it was, but for what was learnt."""

import tomllib

import pytest

from gateway.commissioning.part import Part, Quantity, Setting
from gateway.commissioning.settings_file import with_settings
from gateway.config import parse

USERS = """# of the owner
[vehicle]
name = "Made up"   # its name

[[can]]
name = "can0"
interface = "virtual"
channel = "can0"
protocol = "dbc"
database = "bus.dbc"

[speed]
tolerance = 0.2   # a fifth
minimum_mps = 0.5
# the end of it

[files]
state = "old.state"
"""


def changed(*settings, removed=(), text=USERS, new="sea"):
    from pathlib import Path

    return with_settings(text, settings, removed, Path("land"), Path(new))


def test_a_value_is_changed_and_what_was_there_is_told():
    text = changed(Setting("speed.tolerance", 0.31, "+-0.02, of 9 dives"), new="land")
    assert "tolerance = 0.31 # commissioned: +-0.02, of 9 dives, was 0.2 | a fifth\n" in text
    assert text.replace("0.31 # commissioned: +-0.02, of 9 dives, was 0.2 | a fifth", "0.2   # a fifth") == USERS


def test_commissioned_again_it_tells_of_the_last_time_only():
    once = changed(Setting("speed.tolerance", 0.31, "+-0.02"), new="land")
    twice = changed(Setting("speed.tolerance", 0.35, "+-0.01"), text=once, new="land")
    assert "tolerance = 0.35 # commissioned: +-0.01, was 0.31 | a fifth\n" in twice


def test_a_new_key_stands_behind_the_last_one_of_its_table():
    text = changed(Setting("speed.maximum_mps", 2.0, "sure"), new="land")
    assert "minimum_mps = 0.5\nmaximum_mps = 2.0 # commissioned: sure\n# the end of it\n" in text


def test_new_tables_are_made():
    text = changed(
        Setting("detector.thruster.caution", 1.2, "x"), Setting("detector.speed.usual_mps", 1.0), new="land"
    )
    assert tomllib.loads(text)["detector"] == {"thruster": {"caution": 1.2}, "speed": {"usual_mps": 1.0}}
    assert text.startswith(USERS)
    assert "usual_mps = 1.0\n" in text


def test_keys_are_taken_out():
    text = changed(removed=["speed.minimum_mps", "speed.command", "navigation.dvl_delay_s"], new="land")
    assert text == USERS.replace("minimum_mps = 0.5\n", "")


def test_files_that_are_read_are_found_from_the_other_folder():
    text = changed(new="far/sea")
    assert 'database = "../../land/bus.dbc" # commissioned: moved, was "bus.dbc"' in text
    assert 'state = "old.state"\n' in text
    assert "bus.dbc" in changed(new="land")
    absolute = USERS.replace('"bus.dbc"', '"/bus.dbc"')
    assert changed(text=absolute) == absolute


def test_lists_and_words_are_written_as_they_are_read():
    text = changed(Setting("speed.curve", [[0.25, 0.6], [0.5, 1.0]]), Setting("speed.position", "fix"), new="land")
    speed = tomllib.loads(text)["speed"]
    assert (speed["curve"], speed["position"]) == ([[0.25, 0.6], [0.5, 1.0]], "fix")


@pytest.mark.parametrize("ends", ["", "\n", "\n\n"])
def test_a_file_ends_with_one_line_end(ends):
    assert changed(text=USERS.rstrip("\n") + ends, new="land") == USERS


@pytest.mark.parametrize(
    ("values", "named"),
    [
        (("tolerance", 1.0), "want the path of a key in a table"),
        (("speed.", 1.0), "key = 'speed.'"),
        (("speed.tolerance", float("nan")), "want finite numbers"),
        (("speed.curve", [[0.1, float("inf")]]), "want finite numbers"),
        (("speed.tolerance", 1.0, "two\nlines"), "want one line"),
    ],
)
def test_a_setting_that_no_file_can_have_is_refused(values, named):
    with pytest.raises(ValueError, match=named):
        Setting(*values)


def test_a_part_has_settings_or_misses_something():
    with pytest.raises(ValueError, match="speed: has settings, and misses 'turns'"):
        Part("speed", (Setting("speed.tolerance", 0.1),), missing=("turns",))
    assert Part("speed", quantities=(Quantity("delay", "1 s"),), missing=("turns",)).settings == ()


def test_the_shipped_examples_take_settings():
    from pathlib import Path

    import gateway

    folder = Path(gateway.__file__).parent / "examples"
    for path in folder.glob("*.toml"):
        settings = [Setting("detector.thruster.caution", 1.3, "x"), Setting("files.state", "vehicle.state", "y")]
        text = with_settings(path.read_text(encoding="utf-8"), settings, [], folder, folder)
        assert parse(text, folder).detector.thruster.caution == 1.3
