"""The command `gateway replay` with anything as its log."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from click.testing import CliRunner

from gateway.cli import main
from gateway.commands.replay import CLEAN, FAILED, FAULTS
from hil_tests.fuzz.autopilot_logs import autopilot_log_targets
from hil_tests.fuzz.can_frames import can_frame_targets
from hil_tests.fuzz.can_logs import can_log_targets
from hil_tests.fuzz.files import as_file
from hil_tests.fuzz.frame_bytes import block_of
from hil_tests.fuzz.target import MIB, Target, require

HEAD = """
[vehicle]
name = "fuzzed"

[mavlink]
endpoint = "udpin:127.0.0.1:14660"

[speed]
minimum_mps = 0.8
maximum_mps = 1.2

[navigation]

[[can]]
name = "can0"
protocol = "dronecan"
"""
# one thruster each: the detectors of several are in processes of their own
CONFIGS = (
    """channel = "can0"
[[thruster]]
number = 1
ahead = 1
command = { link = "can0", esc_index = 0 }
rpm = { link = "can0", esc_index = 0 }
""",
    """interface = "mavlink"
channel = "1"
[[thruster]]
number = 1
ahead = 1
command = { link = "mavlink", servo_channel = 1 }
rpm = { link = "can0", esc_index = 0 }
""",
    """channel = "can0"
[[thruster]]
number = 1
ahead = 1
command = { link = "mavlink", servo_channel = 1 }
rpm = { link = "mavlink", esc_index = 0 }
""",
)
NAMES = ("dive.log", "dive.tlog", "dive.BIN", "dive.ulg")
NOTHING = "Error: nothing "


def replay_target() -> Target:
    """The first byte chooses the configuration, and the name of the log."""
    about = "`gateway replay` of any bytes: a result, or exit code 2 and why"
    return Target("replay", about, _replay, _logs, memory_max=128 * MIB)


def _replay(data: bytes) -> None:
    number = data[0] if data else 0
    config, name = number // len(NAMES) % len(CONFIGS), NAMES[number % len(NAMES)]
    with as_file(data[1:], name) as path:
        out = path.parent / "out"
        result = CliRunner().invoke(main, ["replay", str(configs()[config]), str(path), "--out", str(out)])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    require(result.exit_code in (CLEAN, FAULTS, FAILED), f"exit code {result.exit_code}: {result.output}")
    told = "Error: " in result.output and (str(path) in result.output or NOTHING in result.output)
    require(result.exit_code != FAILED or told, f"failed, and did not say of which log: {result.output}")


@cache
def _folder() -> TemporaryDirectory[str]:
    """Kept until the process ends."""
    return TemporaryDirectory()


@cache
def configs() -> list[Path]:
    """Files of `CONFIGS`."""
    paths = []
    for number, text in enumerate(CONFIGS):
        paths.append(Path(_folder().name) / f"{number}.toml")
        paths[-1].write_text(HEAD + text, encoding="utf-8")
    return paths


def _logs() -> list[bytes]:
    """Small logs of every format."""
    seeds = {one.name: one.seeds() for one in (*can_log_targets(), *autopilot_log_targets())}
    firsts = {"can_log": 0, "candump": 0, "tlog": 5, "dataflash": 10, "ulog": 11}
    every = [bytes([first]) + seed for name, first in firsts.items() for seed in seeds[name]]
    return [b"\0" + _esc_log(), *every]


def _esc_log() -> bytes:
    """ESCs and their commands, as candump writes them."""
    seeds = next(one.seeds() for one in can_frame_targets() if one.name == "dronecan")
    frames = block_of(seeds[0][1:]).frames()
    return "".join(f"({1.6e9 + f.time_s:.6f}) can0 {f.identifier:08X}#{f.data.hex()}\n" for f in frames).encode()
