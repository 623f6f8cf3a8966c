"""One live run: the gateway as a process of its own, two that play frames, an autopilot; and what it came to."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from hil_tests.live.autopilot import Autopilot, Text
from hil_tests.live.buses import HOST, Buses
from hil_tests.live.sender import Played, play_bus
from hil_tests.live.traffic import ESCS, THRUSTERS, Fault, Plan
from hil_tests.loopback import free_port

START_S, STOP_S = 60.0, 30.0

CONFIGURATION = """
[vehicle]
name = "Live benchmark"

[mavlink]
endpoint = "udpin:127.0.0.1:{port}"

[align]
sample_rate_hz = 50

[speed]

[navigation]

[supervisor]
clear_after_s = 0.5
texts_per_minute = 600
"""
BUS = """
[[can]]
name = "can{number}"
interface = "{interface}"
channel = "{channel}"
protocol = "dronecan"
"""
THRUSTER = """
[[thruster]]
number = {number}
ahead = {ahead}
command = {{ link = "can{bus}", esc_index = {esc} }}
rpm = {{ link = "can{bus}", esc_index = {esc} }}
"""


@dataclass(frozen=True, slots=True)
class Run:
    """What a live run came to.

    Attributes:
        sent: frames that were played, of both buses.
        wanted: of those, what is for the gateway.
        received: what the gateway says that it has received.
        late_s: how late the latest frame was played: the machine was busy with something else.
        cpu_share: of one processor, while faults came and went.
        memory_mib: the most that the gateway ever had resident.
        behind_s: the longest that readings waited to be judged.
        onsets: (fault, unix time at which it first showed).
        texts: that reached the autopilot.
        findings: lines of the findings file.
    """

    sent: int
    wanted: int
    received: int
    late_s: float
    cpu_share: float
    memory_mib: float
    behind_s: float
    onsets: tuple[tuple[Fault, float], ...]
    texts: tuple[Text, ...]
    findings: tuple[dict[str, object], ...]


def live_run(plan: Plan, buses: Buses) -> Run:
    """A gateway that is new to its vehicle, from the start of the traffic to its end."""
    with TemporaryDirectory() as name:
        folder, port = Path(name), free_port()
        (folder / "gateway.toml").write_text(configuration(buses, port), encoding="utf-8")
        autopilot = Autopilot((HOST, port))
        autopilot.start()
        try:
            with _gateway(folder) as process:
                _wait_for(autopilot, process, folder)
                played, cpu_share, memory_mib = _play(plan, buses, psutil.Process(process.pid))
        finally:
            autopilot.stop()
        return _result(played, cpu_share, memory_mib, autopilot.texts, folder)


def configuration(buses: Buses, port: int) -> str:
    """Of the gateway: four thrusters on each bus, an autopilot that comes to this UDP port."""
    text = CONFIGURATION.format(port=port)
    for number, channel in enumerate(buses.channels):
        text += BUS.format(number=number, interface=buses.interface, channel=channel)
    for index in range(THRUSTERS):
        bus, esc = divmod(index, ESCS)
        text += THRUSTER.format(number=index + 1, bus=bus, esc=esc, ahead=int(index < 2))
    return text


@contextmanager
def _gateway(folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    command = [sys.executable, "-m", "hil_tests.live.gateway", "gateway.toml", "summary.json"]
    with (folder / "log").open("wb") as log, subprocess.Popen(command, cwd=folder, stderr=log) as process:
        try:
            yield process
            process.send_signal(signal.SIGTERM)
            process.wait(STOP_S)
        finally:
            process.kill()


def _wait_for(autopilot: Autopilot, process: subprocess.Popen[bytes], folder: Path) -> None:
    """Until the gateway speaks.

    Raises:
        RuntimeError: it does not.
    """
    end_s = time.monotonic() + START_S
    while not autopilot.heard.wait(0.1):
        if process.poll() is not None or time.monotonic() > end_s:
            raise RuntimeError(f"the gateway did not start: {(folder / 'log').read_text(errors='replace')[-2000:]}")


def _play(plan: Plan, buses: Buses, gateway: psutil.Process) -> tuple[list[Played], float, float]:
    """What was played, the gateway's share of a processor meanwhile, and its most memory in MiB."""
    with get_context("spawn").Pool(2) as pool:
        playing = pool.starmap_async(play_bus, [(bus, plan, buses) for bus in (0, 1)])
        playing.wait(plan.learn_s)
        begin_s, used_s = time.monotonic(), _cpu_s(gateway)
        played = playing.get()
        return played, (_cpu_s(gateway) - used_s) / (time.monotonic() - begin_s), _most_memory_mib(gateway.pid)


def _cpu_s(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


def _most_memory_mib(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    [line] = [line for line in status.splitlines() if line.startswith("VmHWM:")]
    return int(line.split()[1]) / 1024.0


def _result(
    played: Sequence[Played], cpu_share: float, memory_mib: float, texts: Sequence[Text], folder: Path
) -> Run:
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    findings = (folder / "findings.jsonl").read_text(encoding="utf-8").splitlines()
    return Run(
        sent=sum(one.frames for one in played),
        wanted=sum(one.wanted for one in played),
        received=sum(summary["frames"][f"can{bus}"] for bus in (0, 1)),
        late_s=max(one.late_s for one in played),
        cpu_share=cpu_share,
        memory_mib=memory_mib,
        behind_s=summary["behind_max_s"],
        onsets=tuple(sorted((onset for one in played for onset in one.onsets), key=lambda onset: onset[1])),
        texts=tuple(texts),
        findings=tuple(json.loads(line) for line in findings),
    )
