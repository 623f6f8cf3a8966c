"""The command line: one line with the way out, never a traceback."""

import os
import signal
import subprocess
import sys
import time
from importlib.metadata import EntryPoint
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from gateway.cli import load_plugin, main
from gateway.logs import JournalFormatter, formatter
from gateway.tests.conftest import NAVIGATION_WATCH, SPEED_WATCH, TWO_THRUSTERS, write_forecast

CAN_ONLY = TWO_THRUSTERS.replace('link = "mavlink", servo_channel = 3', 'link = "can0", esc_index = 1')


def called(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, list(arguments))
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.exit_code, result.output


@pytest.fixture(autouse=True)
def _listen_briefly(monkeypatch):
    """`gateway check` listens for seconds: here nobody speaks."""
    monkeypatch.setattr("gateway.checking.mavlink.LISTEN_S", 0.05)


@pytest.fixture
def written(tmp_path) -> Path:
    path = tmp_path / "gateway.toml"
    path.write_text(TWO_THRUSTERS)
    return path


def test_version_and_help():
    assert called("--version")[0] == 0
    code, text = called("--help")
    assert code == 0 and "run" in text and "check" in text


@pytest.mark.parametrize("command", ["run", "check"])
def test_config_with_problems_is_told_without_a_traceback(command, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(TWO_THRUSTERS.replace("esc_index = 1", "esc_idx = 1"))
    code, text = called(command, str(path))
    assert code == 1
    assert "thruster[number=2].rpm.esc_idx" in text and "did you mean esc_index?" in text
    assert "Traceback" not in text


def test_config_that_is_not_there(tmp_path):
    code, text = called("run", str(tmp_path / "none.toml"))
    assert code == 1 and "cannot be read" in text


def test_check_of_a_machine_that_can(written):
    code, text = called("check", str(written))
    assert code == 0, text
    assert all(line.startswith("ok ") for line in text.splitlines())
    assert "ok       speed: not watched (no table [speed])" in text.splitlines()
    assert "kinds of frames are read, its load is not known (no bit rate)" in text
    written.write_text(TWO_THRUSTERS.replace('protocol = "dronecan"', 'protocol = "dronecan"\nbitrate = 500000'))
    assert "told where it carries more than 70% of 500 kbit/s" in called("check", str(written))[1]


def test_check_says_how_to_mend_what_it_cannot(tmp_path):
    path = tmp_path / "gateway.toml"
    text = TWO_THRUSTERS.replace('"virtual"', '"socketcan"').replace('"gateway tests"', '"can7"')
    text = text.replace("udpin:127.0.0.1:0", "serial:/dev/no-such-device:57600")
    path.write_text(text + '[files]\nfindings = "no/findings.jsonl"')
    (tmp_path / "vehicle.state").write_text("garbage")
    code, told = called("check", str(path))
    assert code == 1
    lines = {line.split(":")[0].split()[1]: line for line in told.splitlines() if line.startswith("problem")}
    assert set(lines) == {"can", "mavlink", "files.findings", "learnt"}
    assert "name another channel" in lines["can"]
    assert "is /dev/no-such-device connected" in lines["mavlink"]
    assert "mkdir -p" in lines["files.findings"]
    assert "set aside" in lines["learnt"]


def test_check_says_what_the_speed_watch_uses(tmp_path):
    path = tmp_path / "gateway.toml"
    text = TWO_THRUSTERS.replace("esc_index = 0 }\n\n", "esc_index = 0 }\nahead = 1\n\n", 1) + SPEED_WATCH
    path.write_text(text + "[speed.flow]\nspeed_mps = 0.3\ndirection_deg = 85")
    code, told = called("check", str(path))
    assert code == 0, told
    assert f"ok       {path}: thrusters 1, 2 and speed over can0, mavlink" in told
    assert (
        "ok       speed: positions: fixes, else the autopilot's local, else its global position; "
        "normal: 0.8 to 1.2 m/s; range holds at the command of the first seconds under way; better name it: "
        "speed.command; thrusters 1 drive ahead; current: 0.3 m/s towards 085" in told
    )


def test_check_says_what_the_navigation_watch_uses_and_what_it_can_find(tmp_path):
    path = tmp_path / "gateway.toml"
    path.write_text(TWO_THRUSTERS + NAVIGATION_WATCH + 'fix = "global_position"\nwater_density_kgm3 = 998')
    code, told = called("check", str(path))
    assert code == 0, told
    assert f"ok       {path}: thrusters 1, 2 and navigation over can0, mavlink" in told
    assert (
        "ok       navigation: IMU: RAW_IMU, asked for at 50 Hz; DVL: VISION_POSITION_DELTA, else ODOMETRY; "
        "depth: SCALED_PRESSURE2, else SCALED_PRESSURE3, else the autopilot's own, water of 998 kg/m3; "
        "fixes: the autopilot's own position, made from the same DVL: it cannot contradict it; method: ratio" in told
    )
    assert (
        "ok       navigation by the IMU's rate: a DVL's drift of 0.04 m/s/s was found, of 6 dives, at 50 Hz in "
        in told
    )
    assert "; below 8 Hz nothing is judged" in told
    path.write_text(TWO_THRUSTERS)
    assert "ok       navigation: not watched (no table [navigation])" in called("check", str(path))[1]


def test_check_says_which_command_the_normal_range_belongs_to(tmp_path):
    path = tmp_path / "gateway.toml"
    text = TWO_THRUSTERS.replace("esc_index = 0 }\n\n", "esc_index = 0 }\nahead = 1\n\n", 1) + SPEED_WATCH
    path.write_text(text + "command = 0.6")
    code, told = called("check", str(path))
    assert code == 0 and "; normal: 0.8 to 1.2 m/s at the command 0.6; thrusters 1 drive ahead" in told


@pytest.mark.parametrize(("ago_h", "code", "said"), [(1, 0, "km east of the origin"), (100, 1, "do not include")])
def test_check_says_whether_the_forecast_is_of_today(tmp_path, ago_h, code, said):
    path = tmp_path / "gateway.toml"
    write_forecast(tmp_path / "currents.nc", east_mps=0.3, start_s=time.time() - 3600.0 * ago_h)
    flow = '[speed.flow]\nfile = "currents.nc"\nlatitude_deg = 63.4\nlongitude_deg = 10.4'
    path.write_text(f"{TWO_THRUSTERS}[speed]\n{flow}")
    exit_code, told = called("check", str(path))
    (line,) = [line for line in told.splitlines() if " forecast: " in line]
    assert exit_code == code and said in line
    assert "no thruster has a share ahead; current: currents.nc" in told


@pytest.mark.parametrize(
    ("value", "reason"),
    [("no_such_module_anywhere:command", "ModuleNotFoundError"), ("math:pi", "want a click command")],
)
def test_broken_plugin_says_so_in_one_line(value, reason):
    command = load_plugin(EntryPoint("demo", value, "gateway.commands"))
    result = CliRunner().invoke(command, ["--seconds", "3"])
    assert result.exit_code == 1
    assert result.output.startswith("Error: demo cannot be loaded from ") and reason in result.output
    assert result.output.count("\n") == 1


def test_good_plugin_is_the_command_itself():
    assert load_plugin(EntryPoint("main", "gateway.cli:main", "gateway.commands")) is main
    assert isinstance(main, click.Group)


def test_run_as_a_process_stops_on_sigterm_with_a_summary_and_exit_code_0(tmp_path):
    path = tmp_path / "gateway.toml"
    path.write_text(CAN_ONLY)
    environment = {**os.environ, "JOURNAL_STREAM": "1:2"}
    command = [sys.executable, "-c", "from gateway.cli import main; main()", "run", str(path)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        first = process.stderr.readline()
        links = "can0 (virtual gateway tests), mavlink (udpin:127.0.0.1:0)"
        assert first == f"<6>INFO watching Test vehicle: thrusters 1, 2 over {links}\n"
        process.send_signal(signal.SIGUSR1)
        process.send_signal(signal.SIGTERM)
        rest = process.stderr.read()
        assert process.wait(timeout=20) == 0
    assert (
        "stopping" in rest
        and "findings: none" in rest
        and "never judged: thruster 1, thruster 2" in rest
        and "Traceback" not in rest
    )
    assert (tmp_path / "findings.jsonl").exists() and (tmp_path / "vehicle.state").exists()


def test_findings_that_cannot_be_written_are_told(tmp_path):
    path = tmp_path / "gateway.toml"
    path.write_text(CAN_ONLY + '[files]\nfindings = "no/findings.jsonl"')
    code, text = called("run", str(path))
    assert code == 1 and "look at [files]" in text


def test_lines_under_the_journal_have_a_priority_and_no_time():
    assert isinstance(formatter(under_journal=True), JournalFormatter)
    assert "%(asctime)s" in formatter(under_journal=False)._fmt
