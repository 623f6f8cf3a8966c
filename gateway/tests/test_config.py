"""The configuration: what is in the examples, and what is said of everything that is wrong."""

import math
import pickle
from importlib.resources import files
from pathlib import Path

import cantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.speed import FlowModel, SpeedConfig, SpeedCurve
from detectors.speed.flow_models import TidalConstituent, TidalFlow
from drivers.can.vesc_messages import Status, encode_command
from gateway import config as module
from gateway.config import Config, load, parse
from gateway.local_frame import LocalFrame
from gateway.problems import ConfigError
from gateway.tests.conftest import FORECAST_START_S, TWO_THRUSTERS, write_forecast
from gateway.wiring import can_decoder, mavlink_decoder

EXAMPLES = sorted(Path(str(files("gateway") / "examples")).glob("*.toml"))
VENDOR = next(path for path in EXAMPLES if path.stem == "vendor_dbc")
DBC = Path(str(files("gateway") / "examples" / "vendor_thruster.dbc"))


def problems(text: str, folder: Path = Path("/nowhere")) -> dict[str, str]:
    """What is wrong with a configuration text, by key path."""
    with pytest.raises(ConfigError) as caught:
        parse(text, folder)
    return {problem.key: str(problem) for problem in caught.value.problems}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_load_and_give_decoders(path):
    config = load(path)
    thrusters = {
        "bluerov2_heavy_dronecan": 8,
        "dronecan_over_mavlink": 6,
        "pwm_mavlink_esc": 6,
        "vendor_dbc": 2,
        "vesc": 4,
    }
    assert len(config.thruster) == thrusters[path.stem]
    assert all(can_decoder(bus, config.thruster).filters() for bus in config.can)
    assert mavlink_decoder(config.mavlink, config.thruster).drops == {}


def test_there_are_five_examples():
    assert len(EXAMPLES) == 5


def test_what_is_left_out_has_its_default(config):
    assert config.mavlink.component_id == 192
    assert config.mavlink.system_id is None
    assert config.failsafe.thruster_fault == ("warn",)
    assert config.supervisor.repeat_s == 30.0


def test_defaults_of_the_first_example_are_the_defaults(tmp_path):
    written, left_out = load(EXAMPLES[0]), parse(TWO_THRUSTERS.replace("[align]\nsample_rate_hz = 50", ""), tmp_path)
    for section in ("align", "supervisor", "failsafe"):
        assert getattr(written, section) == getattr(left_out, section)


def test_paths_are_relative_to_the_file(config, tmp_path):
    assert config.files.findings == tmp_path / "findings.jsonl"
    assert load(VENDOR).can[0].database == DBC


def test_every_problem_is_told_in_one_go_with_its_key_the_value_and_what_would_be_right():
    found = problems("""
        colour = "yellow"
        [vehicle]
        [[can]]
        name = "can0"
        chanel = "can0"
        protocol = "dronecn"
        [[can]]
        name = "can1"
        interface = "sockecan"
        channel = "can1"
        protocol = "dronecan"
        [mavlink]
        endpoint = "udp:14550"
        system_id = 255
        [[thruster]]
        number = 0
        command = { link = "can1", esc_index = 1 }
        rpm = { link = "can1", esc_index = 1 }
        [[thruster]]
        number = 2
        command = { link = "can1", esc_index = 2 }
        rpm = { link = "can7", esc_index = 2 }
        [detector.thruster]
        treshold_rpm = 80
        order_max = 40
        [align]
        gap_s = -1
        [failsafe]
        thruster_fault = "explode"
        """)
    assert {
        "colour",
        "vehicle.name",
        "can[name=can0].chanel",
        "can[name=can0].channel",
        "can[name=can0].protocol",
        "can[name=can1].interface",
        "mavlink.system_id",
        "thruster[number=0].number",
        "thruster[number=2].rpm.link",
        "detector.thruster.treshold_rpm",
        "detector.thruster.order_max",
        "align.gap_s",
        "failsafe.thruster_fault.0",
    } <= set(found)
    assert "did you mean channel?" in found["can[name=can0].chanel"]
    assert "did you mean threshold_rpm?" in found["detector.thruster.treshold_rpm"]
    assert found["align.gap_s"].startswith("align.gap_s = -1: should be greater than 0")
    assert "want can0, can1, mavlink" in found["thruster[number=2].rpm.link"]
    assert '"explode"' in found["failsafe.thruster_fault.0"] and "'surface'" in found["failsafe.thruster_fault.0"]
    assert "did you mean socketcan?" in found["can[name=can1].interface"]


def thruster(number: int, command: str, rpm: str) -> str:
    return f"[[thruster]]\nnumber = {number}\ncommand = {{ {command} }}\nrpm = {{ {rpm} }}\n"


ONE_CAN = '[vehicle]\nname = "x"\n[[can]]\nname = "can0"\nchannel = "can0"\nprotocol = "dronecan"\n'
ESC = 'link = "can0", esc_index = {}'.format
CLASHES = {
    "number twice": (thruster(1, ESC(0), ESC(0)) + thruster(1, ESC(1), ESC(1)), "thruster[number=1].number"),
    "esc twice": (thruster(1, ESC(0), ESC(0)) + thruster(2, ESC(0), ESC(0)), "thruster[number=2].command.esc_index"),
    "esc of two": (thruster(1, ESC(0), ESC(1)), "thruster[number=1].rpm.esc_index"),
    "directions": (thruster(1, ESC(0), ESC(0) + ", reverse = true"), "thruster[number=1].rpm.reverse"),
    "no rpm": ("[[thruster]]\nnumber = 1\ncommand = { link = 'can0', esc_index = 0 }", "thruster[number=1].rpm"),
    "no command": ("[[thruster]]\nnumber = 1\nrpm = { link = 'can0', esc_index = 0 }", "thruster[number=1].command"),
    "no index": (thruster(1, 'link = "can0"', ESC(0)), "thruster[number=1].command.esc_index"),
    "foreign key": (
        thruster(1, ESC(0) + ", servo_channel = 1", ESC(0)),
        "thruster[number=1].command.servo_channel",
    ),
    "no thruster": ("", "thruster"),
    "a name that commands the terminal": (
        thruster(1, ESC(0), ESC(0)) + 'name = "T\\u001b[2J"',
        "thruster[number=1].name",
    ),
    "no autopilot": (thruster(1, ESC(0), ESC(0)) + "[failsafe]\nthruster_fault = 'hold'", "failsafe.thruster_fault"),
    "can twice": ('[[can]]\nname = "can0"\nchannel = "c"\nprotocol = "dronecan"', "can[name=can0].name"),
    "a bus called mavlink": (
        '[[can]]\nname = "mavlink"\nchannel = "c"\nprotocol = "dronecan"',
        "can[name=mavlink].name",
    ),
    "database missing": ('[[can]]\nname = "a"\nchannel = "c"\nprotocol = "dbc"', "can[name=a].database"),
    "no such database": (
        '[[can]]\nname = "a"\nchannel = "c"\nprotocol = "dbc"\ndatabase = "no.dbc"',
        "can[name=a].database",
    ),
    "bad endpoint": ('[mavlink]\nendpoint = "udp:14550"', "mavlink.endpoint"),
    "servo twice": (
        '[mavlink]\nendpoint = "udpin:127.0.0.1:1"\n'
        + thruster(1, 'link = "mavlink", servo_channel = 1', ESC(0))
        + thruster(2, 'link = "mavlink", servo_channel = 1', ESC(1)),
        "thruster[number=2].command.servo_channel",
    ),
    "actuator twice": (
        '[mavlink]\nendpoint = "udpin:127.0.0.1:1"\n'
        + thruster(1, 'link = "mavlink", actuator = 1', ESC(0))
        + thruster(2, 'link = "mavlink", actuator = 1', ESC(1)),
        "thruster[number=2].command.actuator",
    ),
    "servo and actuator": (
        '[mavlink]\nendpoint = "udpin:127.0.0.1:1"\n'
        + thruster(1, 'link = "mavlink", servo_channel = 1, actuator = 1', ESC(0)),
        "thruster[number=1].command.servo_channel",
    ),
    "scale": (
        '[mavlink]\nendpoint = "udpin:127.0.0.1:1"\n'
        + thruster(1, 'link = "mavlink", servo_channel = 1, minimum = 1600', ESC(0)),
        "thruster[number=1].command",
    ),
    "two speeds": (
        '[mavlink]\nendpoint = "udpin:127.0.0.1:1"\n'
        + thruster(1, ESC(0), 'link = "mavlink", esc_index = 0, rpm_sensor = 1'),
        "thruster[number=1].rpm.esc_index",
    ),
    "not tables": ("thruster = 3", "thruster"),
}


VESC_BUS = '[vehicle]\nname = "x"\n[[can]]\nname = "can0"\nchannel = "can0"\nprotocol = "vesc"\n'
VESC = 'link = "can0", controller_id = {}'.format
DUTY = f'{VESC(7)}, control = "duty"'
SPEED = f"{VESC(7)}, pole_pairs = 7"
VESC_CLASHES = {
    "no controller": ('link = "can0", control = "duty"', SPEED, "command.controller_id", "VESC ID"),
    "no control": (VESC(7), SPEED, "command.control", "SET_DUTY"),
    "control unheard of": (f'{VESC(7)}, control = "speed"', SPEED, "command.control", "'current_rel'"),
    "no full thrust": (f'{VESC(7)}, control = "rpm"', SPEED, "command.maximum", "want electrical rpm at full thrust"),
    "no full current": (f'{VESC(7)}, control = "current"', SPEED, "command.maximum", "want A at full thrust"),
    "neutral": (f"{DUTY}, neutral = 0.1", SPEED, "command.neutral", "means nothing on a vesc link"),
    "scale": (f"{DUTY}, maximum = -1", SPEED, "command", "minimum must be below maximum"),
    "no pole pairs": (DUTY, VESC(7), "rpm.pole_pairs", "pole_pairs: of the motor"),
    "voltage": (DUTY, f'{SPEED}, voltage = "A.b"', "rpm.voltage", "means nothing on a vesc link"),
    "two controllers": (
        DUTY,
        f"{VESC(8)}, pole_pairs = 7",
        "rpm.controller_id",
        "on one vesc bus both are the same ESC",
    ),
    "directions": (DUTY, f"{SPEED}, reverse = true", "rpm.reverse", "command.reverse is False"),
    "out of range": (f'{VESC(255)}, control = "duty"', SPEED, "command.controller_id", "less than or equal to 254"),
}


@pytest.mark.parametrize("name", VESC_CLASHES)
def test_clash_on_a_vesc_bus(name):
    command, rpm, key, said = VESC_CLASHES[name]
    found = problems(VESC_BUS + thruster(1, command, rpm))
    assert said in found[f"thruster[number=1].{key}"]


def test_the_vesc_example_reads_each_thruster_where_it_is():
    config = load(VENDOR.with_name("vesc.toml"))
    decoder = can_decoder(config.can[0], config.thruster)
    commands = [
        encode_command("duty", 0.475, 10),
        encode_command("duty", 0.475, 11),
        encode_command("rpm", -10500, 12),
    ]
    commanded = [reading for frame in commands for reading in decoder.decode(frame)]
    assert [(one.thruster, pytest.approx(one.fraction)) for one in commanded] == [(1, 0.5), (2, -0.5), (3, -0.5)]
    reported = [
        reading for vesc in (10, 11, 12, 13) for reading in decoder.decode(Status(7000, 1.0, 0.5).frame(vesc))
    ]
    assert [(one.thruster, pytest.approx(one.speed_rpm)) for one in reported] == [
        (1, 1000.0),
        (2, -1000.0),
        (3, 1000.0),
        (4, 1000.0),
    ]
    assert not decoder.drops


def test_two_thrusters_cannot_have_one_vesc():
    found = problems(VESC_BUS + thruster(1, DUTY, SPEED) + thruster(2, DUTY, SPEED))
    assert list(found) == ["thruster[number=2].command.controller_id"]


@pytest.mark.parametrize(
    ("command", "value", "fraction"),
    [
        ('control = "duty"', 0.5, 0.5),
        ('control = "current_rel", reverse = true', 0.5, -0.5),
        ('control = "duty", maximum = 0.8, dead_band = 0.1', -0.4, -0.5),
        ('control = "rpm", maximum = 20000, minimum = -10000', -5000, -0.5),
        ('control = "current", maximum = 40', 20, 0.5),
    ],
)
def test_what_a_vesc_is_told_becomes_a_fraction(tmp_path, command, value, fraction):
    config = parse(
        VESC_BUS + thruster(1, f"{VESC(7)}, {command}", SPEED + ", reverse = true" * ("reverse" in command)), tmp_path
    )
    control = config.thruster[0].command.control
    (reading,) = can_decoder(config.can[0], config.thruster).decode(encode_command(control, value, 7))
    assert reading.fraction == pytest.approx(fraction)


@pytest.mark.parametrize("name", CLASHES)
def test_clash(name):
    text, key = CLASHES[name]
    text = ONE_CAN + text if not text.startswith("thruster =") else text + "\n" + ONE_CAN
    assert key in problems(text)


def test_signal_that_the_database_does_not_have_is_named_with_the_nearest(tmp_path):
    (tmp_path / "v.dbc").write_text(DBC.read_text())
    text = Path(VENDOR).read_text().replace("vendor_thruster.dbc", "v.dbc")
    found = problems(text.replace("PortStatus.PulseRate", "PortStatus.PulsRate"), tmp_path)
    assert list(found) == ["thruster[number=1].rpm"]
    assert "PulseRate" in found["thruster[number=1].rpm"]


@pytest.mark.parametrize("suffix", ["kcd", "sym"])
def test_a_database_may_be_of_another_format(tmp_path, suffix):
    cantools.database.dump_file(cantools.database.load_file(DBC), tmp_path / f"v.{suffix}")
    config = parse(Path(VENDOR).read_text().replace("vendor_thruster.dbc", f"v.{suffix}"), tmp_path)
    assert {one.identifier for one in can_decoder(config.can[0], config.thruster).filters()} == {256, 257, 512, 513}


@pytest.mark.parametrize(("name", "said"), [("v.xlsx", "want .dbc, .kcd, .sym, .arxml"), ("v.kcd", "KCD: ")])
def test_a_database_that_cannot_be_read_is_told_once(tmp_path, name, said):
    (tmp_path / name).write_text(DBC.read_text())
    found = problems(Path(VENDOR).read_text().replace("vendor_thruster.dbc", name), tmp_path)
    assert list(found) == ["can[name=thrusters].database"]
    assert said in found["can[name=thrusters].database"]


def test_names_in_a_database_may_be_of_several_words(tmp_path):
    cantools.database.dump_file(cantools.database.load_file(DBC), tmp_path / "v.kcd")
    spaced = (tmp_path / "v.kcd").read_text().replace('"PulseRate"', '"Pulse Rate (Hall)"')
    (tmp_path / "v.kcd").write_text(spaced)
    text = Path(VENDOR).read_text().replace("vendor_thruster.dbc", "v.kcd")
    config = parse(text.replace("PortStatus.PulseRate", "PortStatus.Pulse Rate (Hall)"), tmp_path)
    assert can_decoder(config.can[0], config.thruster).filters()


def speed_problems(text: str, head: str = TWO_THRUSTERS) -> dict[str, str]:
    return problems(head + text)


AHEAD = TWO_THRUSTERS.replace("esc_index = 0 }\n\n", "esc_index = 0 }\nahead = 1\n\n", 1)
RANGE = "minimum_mps = 0.8\nmaximum_mps = 1.2\n"
SAID_OF_SPEED = {
    "[speed]\nminimum_mps = 1.2\nmaximum_mps = 0.8": "speed.maximum_mps = 0.8: want above minimum_mps = 1.2",
    f"[speed]\n{RANGE}curve = [[0.5, 0.6]]": "speed.curve = [[0.5, 0.6]]: minimum_mps and maximum_mps say what is "
    "normal: remove one of them",
    "[speed]\ncommand = 0.6": "speed.command = 0.6: means nothing without minimum_mps and maximum_mps, the range "
    "that belongs to it",
    f"[speed]\n{RANGE}command = 60": "speed.command = 60: should be less than or equal to 1 (that minimum_mps and "
    "maximum_mps belong to; percent? 60 % is 0.6)",
    "[speed]\nminimum_mps = 0.8\nmaximum_mps = 97": "speed.maximum_mps = 97: should be less than or equal to 30 "
    "(m/s? largest normal speed)",
    "[speed]\ncurve = [[25, 0.6], [50, 1.0]]": "speed.curve = [[25.0, 0.6], [50.0, 1.0]]: want [command, m/s] pairs "
    "with commands from -1 to 1; percent? 25 % is 0.25",
    "[speed]\ncurve = [[0.0, 0.6]]": "speed.curve = [[0.0, 0.6]]: want [command, m/s] pairs with commands other "
    "than 0, at which every vehicle stands still",
    "[speed]\ncurve = [[0.5, -0.6]]": "speed.curve = [[0.5, -0.6]]: want [command, m/s] pairs with speeds of the "
    "same sign as their commands, and none of 0",
    "[speed]\ncurve = [[0.5, 60]]": "speed.curve = [[0.5, 60.0]]: want [command, m/s] pairs with speeds up to "
    "30 m/s; m/s?",
    "[speed]\ncurve = [[0.5, 0.6], [0.5, 0.7]]": "speed.curve = [[0.5, 0.6], [0.5, 0.7]]: want [command, m/s] pairs "
    "with rising commands, each once",
    "[speed]\ncurve = [[0.5, 0.9], [1.0, 0.7]]": "speed.curve = [[0.5, 0.9], [1.0, 0.7]]: want [command, m/s] pairs "
    "with speeds that do not fall as commands rise; m/s before the command?",
    "[speed]\n[speed.flow]\nspeed_mps = 0.3\ndirection_deg = -5": "speed.flow.direction_deg = -5: should be greater "
    "than or equal to 0 (true direction that the constant current sets towards)",
    '[speed]\n[detector.speed]\nestimator = "published"': 'detector.speed = {"estimator": "published", '
    '"tolerance": 0.2}: speed.minimum_mps = None: want a number: the published method does not learn its range',
}


@pytest.mark.parametrize("text", SAID_OF_SPEED)
def test_what_is_said_of_the_speed_watch_is_said_once_and_in_the_files_words(text):
    assert list(speed_problems(text, AHEAD).values()) == [SAID_OF_SPEED[text]]
    with pytest.raises(ConfigError) as caught:
        parse(AHEAD + text, Path("/nowhere"))
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize("key", ["curve = [[0.5, 0.6]]", f"{RANGE}command = 0.6"])
def test_what_belongs_to_a_command_needs_thrusters_that_drive_ahead(key):
    ((path, said),) = speed_problems(f"[speed]\n{key}").items()
    assert path in ("speed.curve", "speed.command")
    assert said.endswith(": needs ahead on the thrusters that drive the vehicle")


def test_range_and_its_command_reach_the_detector(tmp_path):
    settings = parse(f"{AHEAD}[speed]\n{RANGE}command = 0.6", tmp_path).detector.speed
    assert settings == SpeedConfig(speed_min_mps=0.8, speed_max_mps=1.2, range_command=0.6)


SPEED_CLASHES = {
    "one of two": ("[speed]\nminimum_mps = 0.8", "speed.maximum_mps"),
    "upside down": ("[speed]\nminimum_mps = 0.8\nmaximum_mps = 0.7", "speed.maximum_mps"),
    "unknown key": ("[speed]\nminimun_mps = 0.8", "speed.minimun_mps"),
    "tolerance": ("[speed]\ntolerance = 20", "speed.tolerance"),
    "position": ('[speed]\nposition = "gps"', "speed.position"),
    "curve": ("[speed]\ncurve = [[1.0, 1.2], [0.5, 0.6]]", "speed.curve"),
    "curve of triples": ("[speed]\ncurve = [[1.0, 1.2, 3.0]]", "speed.curve.0"),
    "estimator": ('[speed]\n[detector.speed]\nestimator = "kalmann"', "detector.speed.estimator"),
    "published without a range": ('[speed]\n[detector.speed]\nestimator = "published"', "detector.speed"),
    "gain": ("[speed]\n[detector.speed]\ngain = -1.0", "detector.speed.gain"),
    "range in the wrong place": ("[speed]\n[detector.speed]\nspeed_min_mps = 1.0", "detector.speed.speed_min_mps"),
    "basis": ("[speed]\n[detector.speed]\nbasis = 3", "detector.speed.basis"),
    "detector without a watch": ("[detector.speed]\ngain = 1.0", "detector.speed"),
    "failsafe without a watch": ('[failsafe]\nspeed_fault = "hold"', "failsafe.speed_fault"),
    "empty flow": ("[speed]\n[speed.flow]", "speed.flow"),
    "flow without direction": ("[speed]\n[speed.flow]\nspeed_mps = 0.3", "speed.flow.direction_deg"),
    "flow of two kinds": (
        '[speed]\n[speed.flow]\nfile = "x.nc"\nspeed_mps = 0.3\ndirection_deg = 9',
        "speed.flow.speed_mps",
    ),
    "file without a site": ('[speed]\n[speed.flow]\nfile = "x.nc"', "speed.flow.latitude_deg"),
    "site without a file": (
        "[speed]\n[speed.flow]\nspeed_mps = 0.3\ndirection_deg = 9\nlatitude_deg = 5\nlongitude_deg = 4",
        "speed.flow.latitude_deg",
    ),
    "no such file": (
        '[speed]\n[speed.flow]\nfile = "x.nc"\nlatitude_deg = 5\nlongitude_deg = 4',
        "speed.flow.file",
    ),
    "local positions with a file": (
        '[speed]\nposition = "local"\n[speed.flow]\nfile = "x.nc"\nlatitude_deg = 5\nlongitude_deg = 4',
        "speed.position",
    ),
    "unknown key of the flow": ("[speed]\n[speed.flow]\nspeed_mpss = 0.3", "speed.flow.speed_mpss"),
    "half a constituent": (
        '[speed]\n[[speed.flow.constituents]]\nname = "M2"\nnorth_mps = 1.0',
        "speed.flow.constituents[name=M2]",
    ),
    "unknown key of a constituent": (
        '[speed]\n[[speed.flow.constituents]]\nname = "M2"\nnorth_mp = 1.0',
        "speed.flow.constituents.0.north_mp",
    ),
    "unknown constituent": (
        '[speed]\n[[speed.flow.constituents]]\nname = "M22"\nsemi_major_mps = 1.0\nsemi_minor_mps = 0.1\n'
        "inclination_deg = 20.0\nlag_deg = 30.0",
        "speed.flow.constituents",
    ),
    "share": (thruster(3, ESC(7), ESC(7)) + "ahead = 2.0", "thruster[number=3].ahead"),
}


@pytest.mark.parametrize("name", SPEED_CLASHES)
def test_clash_of_the_speed_watch(name):
    text, key = SPEED_CLASHES[name]
    first, *others = speed_problems(text)
    assert first == key
    assert all(other.startswith("speed.flow.") for other in others)


def test_speed_watch_needs_the_autopilot():
    found = problems(ONE_CAN + thruster(1, ESC(0), ESC(0)) + "[speed]\n")
    assert list(found) == ["speed"] and "needs a [mavlink] table" in found["speed"]


def test_unknown_keys_within_tables_within_tables_are_named_with_the_nearest():
    found = speed_problems('[speed]\n[[speed.flow.constituents]]\nname = "M2"\nnorth_mp = 1.0')
    assert "did you mean north_mps?" in found["speed.flow.constituents.0.north_mp"]
    assert "did you mean speed_mps?" in speed_problems("[speed]\n[speed.flow]\nsped_mps = 1")["speed.flow.sped_mps"]


def test_no_speed_watch_unless_it_is_asked_for(config, tmp_path):
    assert config.speed is None and config.detector.speed is None
    asked = parse(TWO_THRUSTERS + "[speed]\n", tmp_path)
    assert asked.detector.speed == SpeedConfig()
    assert asked.speed.position == "auto"


def test_settings_of_the_speed_watch_reach_the_detector(tmp_path):
    text = """
        [speed]
        curve = [[-1.0, -0.8], [0.5, 0.6], [1.0, 1.2]]
        tolerance = 0.25
        [detector.speed]
        estimator = "adaptive"
        dimensions = 3
        position_noise_m = 0.5
        """
    settings = parse(AHEAD + text, tmp_path).detector.speed
    assert settings == SpeedConfig(
        speed_curve=SpeedCurve((-1.0, 0.5, 1.0), (-0.8, 0.6, 1.2)),
        tolerance=0.25,
        estimator="adaptive",
        dimensions=3,
        position_noise_m=0.5,
    )


HERE = np.zeros(2)


def flow(text: str, folder: Path) -> FlowModel:
    return parse(f"{TWO_THRUSTERS}[speed]\n[speed.flow]\n{text}", folder).detector.speed.flow_model


def test_constant_current(tmp_path):
    model = flow("speed_mps = 0.4\ndirection_deg = 90.0", tmp_path)
    assert model.velocity_mps(0.0, HERE) == pytest.approx([0.0, 0.4])


def test_tide_by_amplitudes_and_by_ellipse_around_a_mean(tmp_path):
    mean = "speed_mps = 0.1\ndirection_deg = 180.0\n[[speed.flow.constituents]]\nname = 'M2'\n"
    amplitudes = "north_mps = 0.0\nnorth_lag_deg = 0.0\neast_mps = 0.5\neast_lag_deg = 30.0"
    ellipse = "semi_major_mps = 0.5\nsemi_minor_mps = 0.0\ninclination_deg = 0.0\nlag_deg = 30.0"
    expected = TidalFlow((-0.1, 0.0), (TidalConstituent("M2", 0.0, 0.0, 0.5, math.radians(30.0)),))
    for text in (amplitudes, ellipse):
        for time_s in (1.7e9, 1.7e9 + 7000.0):
            said = flow(mean + text, tmp_path).velocity_mps(time_s, HERE)
            assert said == pytest.approx(expected.velocity_mps(time_s, HERE))


def test_forecast_is_read_around_the_dive_site(tmp_path):
    write_forecast(tmp_path / "forecast.nc", east_mps=0.3)
    config = parse(
        f"{TWO_THRUSTERS}[speed]\n[speed.flow]\nfile = 'forecast.nc'\nlatitude_deg = 63.4\nlongitude_deg = 10.4",
        tmp_path,
    )
    assert config.detector.speed.flow_model.velocity_mps(FORECAST_START_S, HERE) == pytest.approx([0.0, 0.3])
    assert config.speed.flow.file == tmp_path / "forecast.nc"
    assert config.speed.origin() == LocalFrame.at_degrees(63.4, 10.4)


@pytest.mark.parametrize(
    ("contents", "said"),
    [(None, "no such file (a relative path starts at the configuration's folder)"), (b"time,u,v", "want a NetCDF")],
)
def test_forecast_that_cannot_be_read_is_named_once(tmp_path, contents, said):
    path = tmp_path / "forecast.nc"
    if contents is not None:
        path.write_bytes(contents)
    site = "latitude_deg = 63.4\nlongitude_deg = 10.4"
    ((key, told),) = problems(f"{TWO_THRUSTERS}[speed]\n[speed.flow]\nfile = 'forecast.nc'\n{site}", tmp_path).items()
    assert key == "speed.flow.file" and told.startswith(f"speed.flow.file = {path}: {said}")
    assert told.count(str(path)) == 1


@pytest.mark.parametrize("text", ["[vehicle", "vehicle = \x00"])
def test_no_toml(text, tmp_path):
    assert "not valid TOML" in next(iter(problems(text, tmp_path).values()))


def test_file_that_is_not_there(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        load(tmp_path / "missing.toml")


def test_config_is_frozen(config):
    with pytest.raises(AttributeError):
        config.vehicle = None
    with pytest.raises(ValueError, match="frozen"):
        config.vehicle.name = "other"


values = st.one_of(
    st.integers(-3, 300), st.floats(), st.text("ab\"'.", max_size=3), st.booleans(), st.just([]), st.just({})
)
tables = st.dictionaries(
    st.sampled_from(["name", "number", "link", "command", "rpm", "endpoint", "thruster", "speed", "flow", "curve"]),
    values,
)


@given(st.dictionaries(st.sampled_from([*Config.__dataclass_fields__]), st.one_of(values, tables, st.lists(tables))))
def test_no_table_whatever_raises_anything_but_config_error(data):
    with pytest.raises(ConfigError):  # none of these is valid: there is no complete thruster
        module._Parser(data, Path("/nowhere")).config("generated", "")


def test_problems_go_from_process_to_process(tmp_path):
    with pytest.raises(ConfigError) as raised:
        parse("[vehicle]", tmp_path, "some.toml")
    passed_on = pickle.loads(pickle.dumps(raised.value))  # noqa: S301  our own
    assert (str(passed_on), passed_on.problems) == (str(raised.value), raised.value.problems)
