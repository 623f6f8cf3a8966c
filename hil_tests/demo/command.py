"""The command `gateway demo`: starts rig and gateway in one process, shows what happens, sums up."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import shlex
import signal
import socket
import sys
import time
from collections.abc import Iterator, Sequence
from math import nan
from pathlib import Path

import click
from rich.console import Console

from drivers.clock import Clock
from gateway.channel import NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.pipeline import Outcome
from gateway.run import run
from gateway.summary import Summary as GatewaySummary
from hil_tests.demo.configuration import CONFIG_FILE, RECORDINGS, write_config
from hil_tests.demo.display import Display, LiveDisplay, PlainDisplay, View, closing_table
from hil_tests.demo.pictures import FILES, draw_pictures, estimated_tracks
from hil_tests.demo.plan import COURSE, ENTANGLED, Plan, plan
from hil_tests.demo.record import Judged, JudgedNavigation, JudgedSpeed, Recording, Truth, happenings
from hil_tests.demo.summary import Summary, summarize
from hil_tests.demo.tracks import Track
from hil_tests.rig.embedded import EmbeddedVehicle, Moment
from hil_tests.rig.pilot import SURVEYING

CHANNEL = "gateway-demo"
FRAMES_PER_SECOND = 4
LOG_FILE = "gateway.log"


@click.command(short_help="Show the gateway at work on a simulated vehicle.")
@click.option(
    "--seconds", type=click.FloatRange(min=5.0), default=110.0, show_default=True, help="How long it lasts."
)
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=Path("out/demo"), show_default=True,
              help="Folder for plots, findings and configuration.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of pilot and noise.")
@click.option("--fault-at", type=click.FloatRange(min=0.0), help="Second at which weeds catch thruster 3.")
@click.option("--plain", is_flag=True, help="Lines of text instead of a live table.")
def demo(seconds: float, out: Path, seed: int, fault_at: float | None, plain: bool) -> None:
    """Show the gateway at work on a simulated vehicle: weeds in thruster 3, a current, a net on the hull that halves
    the speed, and a DVL that drifts; and how the autopilot is told of all but the current.

    Exit code 0: what went wrong was found and there was no false alarm; else 1.
    """
    console = Console()
    out.mkdir(parents=True, exist_ok=True)
    display: Display = PlainDisplay(console) if plain or not console.is_terminal else LiveDisplay(console)
    demonstration = Demonstration(out, plan(seconds, fault_at), seed)
    summary = demonstration.run(display)
    console.print(closing_table(summary, demonstration.start_s))
    for plot in demonstration.plots:
        console.print(f"plot: {plot}", soft_wrap=True, markup=False, highlight=False)
    for line in _see_it_again(out):
        console.print(line, soft_wrap=True, markup=False, highlight=False)
    raise SystemExit(0 if summary.passed else 1)


def _see_it_again(folder: Path) -> Iterator[str]:
    """The newest recording, and the command that judges it anew and writes a report of it."""
    recordings = sorted((folder / RECORDINGS).glob("*.mcap"))
    if recordings:
        yield f"recording: {recordings[-1]}"
        program = os.path.relpath(sys.argv[0])
        replay = [program, "replay", str(folder / CONFIG_FILE), str(recordings[-1]), "--out", str(folder / "dive")]
        yield f"a report of it: {shlex.join(replay)}"


class Demonstration:
    """One run of rig and gateway together.

    Args:
        folder: for all files; exists.
        script: what happens when.
        seed: of pilot and noise.
    """

    def __init__(self, folder: Path, script: Plan, seed: int) -> None:
        self.plots = [folder / name for name in FILES]
        self._folder = folder
        self._plan = script
        self._clock = Clock()
        self._recording = Recording()
        port = _free_udp_port()
        self._config = write_config(folder, CHANNEL, port)
        self._vehicle = EmbeddedVehicle(
            interface="virtual",
            channel=CHANNEL,
            gateway=("127.0.0.1", port),
            now=self._clock.now,
            seed=seed,
            faults=script.faults(),
            style=SURVEYING,
            course=COURSE,
            surroundings=script.surroundings(),
        )
        self.start_s = self._vehicle.start_s

    def run(self, display: Display) -> Summary:
        """Run it to its end, or to Ctrl-C; draw the plots and sum up."""
        began_s, used_s = time.monotonic(), time.process_time()
        with _logging_to(self._folder / LOG_FILE), self._vehicle, display:
            watched = asyncio.run(self._drive(display))
        lasted_s = time.monotonic() - began_s
        load = (time.process_time() - used_s) / lasted_s
        moments, drift_s = self._vehicle.moments, self.start_s + self._plan.drift_s
        tracks = estimated_tracks(self._config, self._recording, moments, drift_s)
        summary = summarize(
            self._recording,
            self._vehicle.notes,
            self._truth(),
            lasted_s=lasted_s,
            counts=self._recording.counts() | _counts(watched),
            load=load,
            left_out=self._plan.left_out(),
            position_errors_m=_last_errors_m(tracks, moments) if lasted_s > self._plan.drift_s else (nan, nan),
        )
        draw_pictures(self._folder, self._plan, summary, self._recording, moments, tracks, self.start_s)
        return summary

    async def _drive(self, display: Display) -> GatewaySummary:
        stop = asyncio.Event()
        with _stopping_on_interrupt(stop):
            async with asyncio.TaskGroup() as group:
                gateway = group.create_task(
                    run(self._config, clock=self._clock, observer=self._observe, stop=stop), name="gateway"
                )
                group.create_task(self._show(display, stop), name="display")
        return gateway.result()

    def _observe(self, outcome: Outcome) -> None:
        match outcome:
            case ThrusterJudgement(number, sample, verdict):
                self._recording.add(number, Judged(sample, verdict), self._clock.now())
            case SpeedJudgement(pose, speed_verdict):
                self._recording.add_speed(JudgedSpeed(pose, speed_verdict), self._clock.now())
            case NavigationJudgement(measured, navigation_verdict):
                self._recording.add_navigation(JudgedNavigation(measured, navigation_verdict), self._clock.now())

    async def _show(self, display: Display, stop: asyncio.Event) -> None:
        while not stop.is_set() and (since_s := self._clock.now() - self.start_s) < self._plan.seconds:
            display.show(self._view(since_s))
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(stop.wait(), 1.0 / FRAMES_PER_SECOND)
        stop.set()
        display.show(self._view(min(self._clock.now() - self.start_s, self._plan.seconds)))

    def _view(self, since_s: float) -> View:
        return View(
            since_s=since_s,
            lasts_s=self._plan.seconds,
            start_s=self.start_s,
            mode=self._vehicle.mode,
            voltage_v=self._vehicle.vehicle.battery.voltage_v,
            judged=self._recording.latest(),
            speed=self._recording.speed[-1] if self._recording.speed else None,
            navigation=self._recording.navigation[-1] if self._recording.navigation else None,
            happenings=happenings(self._vehicle.notes, self._truth(), self.start_s + since_s),
        )

    def _truth(self) -> Truth:
        weeds_shown_s = self._vehicle.shown_s.get(ENTANGLED, nan)
        return self._plan.truth(self.start_s, weeds_shown_s, self._vehicle.slowed_s)


@contextlib.contextmanager
def _logging_to(path: Path) -> Iterator[None]:
    """The gateway's own log goes into a file: on the terminal it would tear the table apart."""
    handler = logging.FileHandler(path, mode="w", encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    root = logging.getLogger()
    level = root.level
    root.addHandler(handler)
    root.setLevel(logging.INFO)
    try:
        yield
    finally:
        root.setLevel(level)
        root.removeHandler(handler)
        handler.close()


@contextlib.contextmanager
def _stopping_on_interrupt(stop: asyncio.Event) -> Iterator[None]:
    """Ctrl-C ends the run as its time being over would: with plot and summary."""
    loop = asyncio.get_running_loop()
    loop.add_signal_handler(signal.SIGINT, stop.set)
    try:
        yield
    finally:
        loop.remove_signal_handler(signal.SIGINT)


def _last_errors_m(tracks: tuple[Track, Track], moments: Sequence[Moment]) -> tuple[float, float]:
    """Of both tracks at their ends."""
    with_isolation_m, without_m = (float(one.errors_m(moments)[-1]) if len(one.time_s) else nan for one in tracks)
    return with_isolation_m, without_m


def _counts(watched: GatewaySummary) -> dict[str, int]:
    received = {f"received on {link}": count for link, count in sorted(watched.frames.items())}
    dropped = {
        f"dropped at {place}: {cause}": count
        for place, causes in watched.drops.items()
        for cause, count in causes.items()
    }
    return received | (dropped or {"dropped": 0})


def _free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        return int(link.getsockname()[1])
