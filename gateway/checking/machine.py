"""Whether this machine can do what a configuration asks for: each check is one line, with the way to mend it."""

from __future__ import annotations

import asyncio
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from detectors.speed import SpeedConfig
from detectors.speed.gridded_flow import GriddedFlow
from drivers.can.interface import LISTEN_ONLY, SOCKETCAN, port_opener
from drivers.can.network_interface import controller
from drivers.can.port import CanPortError
from drivers.clock import Clock
from gateway import state
from gateway.can_source import options_of, rates_of
from gateway.checking.forwarded_can import check_forwarded
from gateway.checking.mavlink import check_mavlink
from gateway.checking.metrics import check_metrics
from gateway.checking.navigation import possible, sources
from gateway.checking.recording import check_recording
from gateway.checking.result import CheckResult
from gateway.config import Config
from gateway.config_sections import CanBus, Speed, Thruster
from gateway.control.server import is_running
from gateway.current_forecast import coverage, why_unknown
from gateway.failsafe_settings import in_words
from gateway.wiring import can_decoder

INTERFACES = Path("/sys/class/net")
LISTENS = "listen-only: sends nothing, acknowledges nothing"
ACKNOWLEDGES = "sends nothing, but acknowledges frames"
RANGE_UNNAMED = "range holds at the command of the first seconds under way; better name it: speed.command"

POSITIONS: Mapping[str, str] = {
    "auto": "fixes, else the autopilot's local, else its global position",
    "fix": "GPS_INPUT or GPS_RAW_INT",
    "local": "LOCAL_POSITION_NED",
    "global": "GLOBAL_POSITION_INT",
}


def checks(config: Config) -> Iterator[CheckResult]:
    """Looks at every link and file of a configuration. Nothing is changed.

    Nothing is sent, but where the autopilot has to be asked for one of its CAN buses.
    """
    if is_running(config.files.control):
        remedy = "stop it to have its links checked; gateway tell CONFIG status asks how it is"
        yield CheckResult("gateway", False, "one runs with this configuration, and holds its links", remedy)
    else:
        yield from _check_links(config)
        if config.metrics is not None:
            yield check_metrics(config.metrics)
    yield CheckResult("failsafe", True, in_words(config.failsafe))
    if config.speed is None or config.detector.speed is None:
        yield CheckResult("speed", True, "not watched (no table [speed])")
    else:
        yield _check_speed(config.speed, config.detector.speed, config.thruster)
        if isinstance(config.detector.speed.flow_model, GriddedFlow):
            yield _check_forecast(config.detector.speed.flow_model, Clock().now())
    if config.navigation is None or config.detector.navigation is None:
        yield CheckResult("navigation", True, "not watched (no table [navigation])")
    else:
        yield CheckResult("navigation", True, sources(config.navigation, config.detector.navigation))
        yield CheckResult("navigation by the IMU's rate", True, possible())
    yield _check_folder("findings", config.files.findings)
    yield _check_folder("state", config.files.state)
    yield _check_folder("control", config.files.control)
    yield _check_state(config.files.state)
    yield check_recording(config.recording)


def _check_links(config: Config) -> Iterator[CheckResult]:
    for bus in config.can:
        if not bus.forwarded:
            yield _check_bus(bus, config)
    if config.mavlink is not None:
        yield from check_mavlink(config.mavlink, config.files.state)
        for bus in config.can:
            if bus.forwarded:
                yield check_forwarded(bus, config, config.mavlink)


def _check_bus(bus: CanBus, config: Config) -> CheckResult:
    subject = f"can {bus.name}"
    filters = can_decoder(bus, config.thruster).filters()
    try:
        port = port_opener(bus.interface, bus.channel, **options_of(bus))(filters, Clock(), Counter())
    except (CanPortError, ValueError) as error:
        return CheckResult(subject, False, f"{bus.interface} {bus.channel} does not open: {error}", _bus_remedy(bus))
    port.close()
    if bus.interface == SOCKETCAN and _operstate(bus.channel) == "down":
        return CheckResult(subject, False, f"{bus.channel} is down", _bus_remedy(bus))
    reads = f"{bus.interface} {bus.channel} opens, {len(filters)} kinds of frames are read"
    return CheckResult(subject, True, ", ".join([reads, _load(bus), *_manners(bus)]))


def _load(bus: CanBus) -> str:
    rates = asyncio.run(rates_of(bus))
    if rates is None:
        return "its load is not known (no bit rate)"
    return f"told where it carries more than {bus.load_max:.0%} of {rates.nominal / 1000.0:g} kbit/s"


def _manners(bus: CanBus) -> Iterator[str]:
    """What its controller does by itself, though nothing is sent."""
    if bus.interface == SOCKETCAN:
        found = asyncio.run(controller(bus.channel))
        if found is not None:
            yield LISTENS if found.listen_only else f"{ACKNOWLEDGES} (ip link has listen-only off)"
            restart = f"restarts {found.restart_s:g} s" if found.restart_s else "has to be restarted by hand"
            yield f"{restart} after bus-off"
    elif bus.interface in LISTEN_ONLY:
        yield LISTENS if bus.listen_only else f"{ACKNOWLEDGES} (listen_only = false)"


def _bus_remedy(bus: CanBus) -> str:
    if bus.interface != SOCKETCAN:
        return f"see python-can's documentation of {bus.interface}, and that no other program holds the device"
    if (INTERFACES / bus.channel).exists():
        return f"bring it up: sudo ip link set {bus.channel} up type can bitrate 1000000 restart-ms 100"
    found = sorted(path.name for path in INTERFACES.glob("*can*")) if INTERFACES.is_dir() else []
    here = ", ".join(found) or "none"
    return f"connect the adapter, load its driver, or name another channel (CAN interfaces here: {here})"


def _operstate(channel: str) -> str:
    try:
        return (INTERFACES / channel / "operstate").read_text(encoding="ascii").strip()
    except OSError:
        return "unknown"


def _check_speed(speed: Speed, settings: SpeedConfig, thrusters: Sequence[Thruster]) -> CheckResult:
    pushing = [str(one.number) for one in thrusters if one.ahead]
    command = f"thrusters {', '.join(pushing)} drive ahead" if pushing else "no thruster has a share ahead"
    positions = f"positions: {POSITIONS[speed.position]}"
    normal = _normal_speed(settings, bool(pushing))
    return CheckResult("speed", True, "; ".join([positions, normal, command, _current(speed)]))


def _normal_speed(settings: SpeedConfig, commanded: bool) -> str:
    if settings.speed_min_mps is not None:
        normal = f"normal: {settings.speed_min_mps:g} to {settings.speed_max_mps:g} m/s"
        if settings.range_command is not None:
            return f"{normal} at the command {settings.range_command:g}"
        return f"{normal}; {RANGE_UNNAMED}" if commanded else normal
    source = "learnt" if settings.speed_curve is None else "the given curve"
    return f"normal: {source}, +-{settings.tolerance:.0%}"


def _current(speed: Speed) -> str:
    flow = speed.flow
    if flow is None:
        return "current: learnt"
    if flow.file is not None:
        return f"current: {flow.file.name}"
    mean = "" if flow.speed_mps is None else f"{flow.speed_mps:g} m/s towards {flow.direction_deg:03.0f}"
    return f"current: {', '.join(filter(None, [mean, *(one.name for one in flow.constituents)]))}"


def _check_forecast(flow: GriddedFlow, now_s: float) -> CheckResult:
    why = why_unknown(flow, now_s)
    if why is not None:
        return CheckResult(
            "forecast", False, why, "fetch one that covers the dive; without it, the current is learnt"
        )
    return CheckResult("forecast", True, coverage(flow))


def _check_folder(what: str, path: Path) -> CheckResult:
    subject = f"files.{what}"
    if not path.parent.is_dir():
        return CheckResult(subject, False, f"no folder {path.parent}", f"mkdir -p {path.parent}")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        return CheckResult(
            subject, False, f"{path} cannot be written", "give this user the right to, or name another"
        )
    return CheckResult(subject, True, str(path))


def _check_state(path: Path) -> CheckResult:
    try:
        found = state.load(path)
    except (state.StateError, OSError) as error:
        remedy = "it will be set aside and all is learnt anew"
        return CheckResult("learnt state", False, f"{path} {error}", remedy)
    if found is None:
        return CheckResult("learnt state", True, "nothing yet")
    return CheckResult("learnt state", True, f"{', '.join(sorted(found.learnt))}, saved {found.saved.date()}")
