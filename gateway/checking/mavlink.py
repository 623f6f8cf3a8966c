"""The MAVLink part of `gateway check`: whether the link opens, who is heard on it, and what it accepts."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from drivers.clock import Clock
from drivers.mavlink.endpoint import SerialPort, TcpClient, UdpClient, UdpServer, parse_endpoint
from drivers.mavlink.signing import REPLAYED, Signing
from drivers.mavlink.transports import open_transport
from gateway.checking.result import CheckResult
from gateway.checking.survey import MavlinkSurvey, Sender
from gateway.config_sections import Mavlink
from gateway.problems import ConfigError
from gateway.signing.link import ADVICE, begun
from gateway.signing.settings import accepted

OPEN_TIMEOUT_S = 3.0
# Everything that speaks MAVLink beats once a second; a heartbeat may be lost.
LISTEN_S = 3.0
OTHERS_SHOWN = 4


def check_mavlink(mavlink: Mavlink, state: Path) -> Iterator[CheckResult]:
    """Looks at the link and listens on it for a few seconds. Nothing is sent, nothing is changed.

    Args:
        mavlink: the link.
        state: the state file, beside which stamps of signed packets are kept.
    """
    clock = Clock()
    signing = None
    try:
        signing = begun(mavlink, state, clock.now())
    except ConfigError as error:
        for problem in error.problems:
            remedy = "the gateway does not start without its key"
            yield CheckResult("mavlink signing key", False, f"{problem.value} {problem.wanted}", remedy)
    yield _link(mavlink, signing, clock)
    yield CheckResult("mavlink accepts", True, accepted(mavlink))


def _link(mavlink: Mavlink, signing: Signing | None, clock: Clock) -> CheckResult:
    subject = f"mavlink {mavlink.endpoint}"
    survey = MavlinkSurvey(signing)
    try:
        lost = asyncio.run(_listen(mavlink, survey, clock))
    except (OSError, TimeoutError) as error:
        return CheckResult(subject, False, f"does not open: {error or 'no answer'}", _remedy(mavlink))
    if lost:
        return CheckResult(subject, False, f"opens, and is lost: {lost}", _remedy(mavlink))
    return heard(subject, mavlink, list(survey.senders.values()))


async def _listen(mavlink: Mavlink, survey: MavlinkSurvey, clock: Clock) -> str:
    """Listens for a while; why the connection was lost, "" if it was not."""
    lost: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    async with asyncio.timeout(OPEN_TIMEOUT_S):
        transport = await open_transport(
            parse_endpoint(mavlink.endpoint),
            lambda data: survey.feed(data, clock.now()),
            lambda reason: None if lost.done() else lost.set_result(reason),
            Counter(),
        )
    try:
        await asyncio.wait([lost], timeout=LISTEN_S)
    finally:
        transport.close()
    return lost.result() if lost.done() else ""


def _remedy(mavlink: Mavlink) -> str:
    match parse_endpoint(mavlink.endpoint):
        case SerialPort(device=device):
            return f"is {device} connected, and is this user in its group (sudo usermod -aG dialout $USER)?"
        case UdpServer(port=port):
            return f"another program may hold port {port} (sudo ss -lunp), or the address is not this machine's"
        case TcpClient(host=host, port=port) | UdpClient(host=host, port=port):
            return f"is the autopilot's server at {host}:{port} running and reachable?"


def heard(subject: str, mavlink: Mavlink, senders: Sequence[Sender]) -> CheckResult:
    """What follows from who was heard: which autopilot the gateway would follow, and why it would not."""
    if not senders:
        return CheckResult(subject, True, f"opens; nothing heard in {LISTEN_S:g} s")
    autopilots = [one for one in senders if one.autopilot]
    return (
        _rivals(subject, mavlink, autopilots)
        or _refused(subject, mavlink, autopilots)
        or CheckResult(subject, True, f"opens; heard in {LISTEN_S:g} s: {_all(mavlink, senders)}")
    )


def _rivals(subject: str, mavlink: Mavlink, autopilots: Sequence[Sender]) -> CheckResult | None:
    """The autopilot that is ours does not stand out. (Of those that are refused, the gateway knows nothing.)"""
    let_in = [one.system_id for one in autopilots if not one.refusal]
    if mavlink.system_id is None and len(let_in) > 1:
        detail = f"several autopilots (systems {', '.join(map(str, sorted(let_in)))})"
        return CheckResult(subject, False, detail, "set mavlink.system_id")
    heard_systems = sorted(one.system_id for one in autopilots)
    if mavlink.system_id is None or not heard_systems or mavlink.system_id in heard_systems:
        return None
    detail = f"mavlink.system_id is {mavlink.system_id}, but heard is system {', '.join(map(str, heard_systems))}"
    return CheckResult(subject, False, detail, "name the vehicle's own, or leave it out")


def _refused(subject: str, mavlink: Mavlink, autopilots: Sequence[Sender]) -> CheckResult | None:
    """Our autopilot is heard, and may not be read."""
    ours = [one for one in autopilots if mavlink.system_id in (None, one.system_id)]
    if not ours or not all(one.refusal for one in ours):
        return None
    remedy = ADVICE.get(ours[0].refusal, "its stamps do not rise: is a recording played?")
    return CheckResult(subject, False, f"all of {ours[0].name()} is refused: {ours[0].refusal}", remedy)


def _all(mavlink: Mavlink, senders: Sequence[Sender]) -> str:
    """Autopilots first, then those who are heard most."""
    ordered = sorted(senders, key=lambda one: (not one.autopilot, -one.packets))
    shown = [f"{one.name()}, {_signature(mavlink, one)}" for one in ordered[:OTHERS_SHOWN]]
    more = len(ordered) - len(shown)
    shown += [f"{more} more"] if more else []
    shown += [] if ordered[0].autopilot else ["no autopilot among them"]
    return "; ".join(shown)


def _signature(mavlink: Mavlink, sender: Sender) -> str:
    if sender.refusal:
        return f"refused: {sender.refusal}"
    if mavlink.signing_key is not None:
        trouble = ", ".join(f"{n} {cause}" for cause, n in sender.refused.items() if cause != REPLAYED)
        signed = "signed with our key" if sender.signed else "not signed"
        return f"{signed} (but {trouble})" if trouble else signed
    if sender.signed and sender.autopilot:
        return "signed (not checked; it may refuse what we say: set mavlink.signing_key)"
    return "signed (not checked)" if sender.signed else "not signed"
