"""A CAN bus of the autopilot in the configuration, and what its sampling means for silence and alignment."""

import pytest

from detectors.verdict import Level
from drivers.readings import LinkState, ThrusterReport
from gateway.config import ConfigError, parse
from gateway.rules import SAMPLED_SILENT_S, silence_watch
from gateway.silence import SilenceWatch, Watched
from gateway.tests.conftest import TWO_THRUSTERS
from gateway.torn_speeds import TornSpeeds

FORWARDED = TWO_THRUSTERS.replace('"virtual"', '"mavlink"').replace('"gateway tests"', '"1"')
SECOND = '\n[[can]]\nname = "can1"\ninterface = "mavlink"\nchannel = "2"\nprotocol = "dronecan"\n'
ALIGN = "[align]\nsample_rate_hz = 50\n"
ADAPTER = '\n[[can]]\nname = "can1"\nchannel = "can1"\nprotocol = "dronecan"\n'


def problems(text, folder):
    with pytest.raises(ConfigError) as caught:
        parse(text, folder)
    return [(problem.key, problem.wanted) for problem in caught.value.problems]


def test_bus_of_the_autopilot_is_a_link_like_any_other(tmp_path):
    config = parse(FORWARDED, tmp_path)
    assert config.can[0].forwarded
    assert config.links() == ["can0", "mavlink"]


@pytest.mark.parametrize("channel", ["can0", "0", "10", "-1"])
def test_channel_is_the_number_of_the_autopilots_bus(channel, tmp_path):
    ((path, wanted),) = problems(FORWARDED.replace('channel = "1"', f'channel = "{channel}"'), tmp_path)
    assert path == "can[name=can0].channel"
    assert '"1" for CAN1' in wanted


@pytest.mark.parametrize("line", ["bitrate = 1000000", "load_max = 0.5"])
def test_what_the_bus_is_not_measured_for_is_refused(line, tmp_path):
    ((path, wanted),) = problems(FORWARDED.replace('channel = "1"', f'channel = "1"\n{line}'), tmp_path)
    assert path == f"can[name=can0].{line.split()[0]}"
    assert wanted.endswith("remove it")


def test_one_bus_at_a_time(tmp_path):
    ((path, wanted),) = problems(FORWARDED + SECOND, tmp_path)
    assert path == "can[name=can1].interface"
    assert "one of its buses at a time" in wanted
    assert len(parse(FORWARDED + ADAPTER, tmp_path).can) == 2  # beside one with an adapter of its own


def test_it_needs_the_link_that_it_comes_over(tmp_path):
    text = FORWARDED.replace('[mavlink]\nendpoint = "udpin:127.0.0.1:0"\n', "")
    assert ("can[name=can0].interface", "needs a [mavlink] table: the autopilot forwards its bus over that link") in (
        problems(text, tmp_path)
    )


def test_misspelt_it_is_guessed(tmp_path):
    ((_, wanted),) = problems(FORWARDED.replace('"mavlink"', '"mavlnk"', 1), tmp_path)
    assert wanted.endswith("did you mean mavlink?")


def test_samples_are_coarser_unless_the_file_says_otherwise(tmp_path):
    config = parse(FORWARDED.replace(ALIGN, ""), tmp_path)
    aligned = config.alignment(config.thruster[0])
    assert (aligned.sample_rate_hz, aligned.gap_s, aligned.stale_s) == (10.0, 0.25, 0.25)
    config = parse(FORWARDED, tmp_path)
    assert config.alignment(config.thruster[0]).sample_rate_hz == 50.0
    config = parse(TWO_THRUSTERS.replace(ALIGN, ""), tmp_path)
    assert config.alignment(config.thruster[0]) == config.align


# Silence ------------------------------------------------------------------------------------------

BUS = Watched("link", "link can0", "can0", "can0", SAMPLED_SILENT_S, carrier="mavlink")
CARRIER = Watched("link", "link mavlink", "mavlink", "mavlink", 5.0)
RPM = Watched("signal", "thruster 1 rpm", "T1 RPM", "can0", SAMPLED_SILENT_S)


def troubles(watch, time_s):
    return [one.label for one in watch.judge(time_s, False) if one.level is not Level.NORMAL]


@pytest.fixture
def watch():
    watch = SilenceWatch([BUS, CARRIER], [RPM])
    list(watch.judge(0.0, False))
    for link in ("can0", "mavlink"):
        watch.hear_link(link, 10.0)
    watch.hear_signal("thruster 1 rpm", 10.0)
    return watch


def hear(watch, link, start_s, end_s):
    """A link that speaks each second; what is in trouble at the end of it."""
    told = []
    for second in range(round(start_s), round(end_s) + 1):
        watch.hear_link(link, float(second))
        told = troubles(watch, second + 0.1)
    return told


def test_silent_bus_is_told_while_mavlink_is_alive(watch):
    assert hear(watch, "mavlink", 11, 14) == []
    assert hear(watch, "mavlink", 15, 17) == ["can0"]


def test_of_a_silent_mavlink_the_bus_is_no_news(watch):
    assert [troubles(watch, 10.0 + second) for second in range(1, 30)][-1] == ["mavlink"]
    assert all("can0" not in troubles(watch, 10.0 + second) for second in range(30, 60))
    assert hear(watch, "mavlink", 70, 73) == []  # the bus gets its time to come back
    assert hear(watch, "mavlink", 74, 77) == ["can0"]


def test_nor_of_one_that_is_down(watch):
    watch.link_state(LinkState(10.5, "mavlink", False, "silent for 6 s"))
    watch.hear_link("mavlink", 20.0)
    assert troubles(watch, 20.1) == ["mavlink"]


def test_configured_limits(tmp_path):
    watch = silence_watch(parse(FORWARDED, tmp_path), [Watched("signal", "x", "X", "can0", 1.5)])
    list(watch.judge(0.0, False))
    watch.hear_signal("x", 1.0)
    for second in range(1, 6):
        for link in ("can0", "mavlink"):
            watch.hear_link(link, float(second))
    assert troubles(watch, 5.0) == []
    for link in ("can0", "mavlink"):
        watch.hear_link(link, 7.0)
    assert "X" in troubles(watch, 7.0)


# Speeds between which reports were lost -----------------------------------------------------------


def admitted(reports):
    """Of (time, speed): the times of those that are passed on."""
    torn = TornSpeeds(0.25)
    return [time_s for time_s, speed_rpm in reports if torn.admits(ThrusterReport(time_s, 1, speed_rpm))]


@pytest.mark.parametrize(
    "reports",
    [
        [(0.0, 1000.0), (0.02, 2000.0), (0.04, 500.0)],  # none is lost
        [(0.0, 1000.0), (0.2, 1040.0), (0.22, 1000.0)],  # some are, and nothing happened
        [(0.0, 1000.0), (0.3, 2000.0), (0.32, 2000.0)],  # a gap anyway
        [(0.0, 0.0), (0.2, 0.0)],
        [(0.0, 1000.0), (0.1, None), (0.12, 1000.0)],
        [(100.0, 1000.0), (5.0, 2000.0), (5.02, 2000.0)],  # a clock that was set back
    ],
)
def test_speeds_that_may_be_joined_are_passed_on(reports):
    assert admitted(reports) == [time_s for time_s, _ in reports]


def test_a_change_that_nobody_saw_becomes_a_gap():
    reports = [(0.0, 1000.0), (0.1, 1500.0), (0.12, 1500.0), (0.24, 1500.0), (0.26, 1500.0), (0.28, 1520.0)]
    assert admitted(reports) == [0.0, 0.26, 0.28]


def test_and_so_does_one_of_the_direction():
    assert admitted([(0.0, 100.0), (0.1, -100.0), (0.2, -100.0), (0.3, -100.0)]) == [0.0, 0.3]
