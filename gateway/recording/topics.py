"""What the channels of a recording are called."""

from __future__ import annotations

import re

from drivers.bus_readings import (
    BabblingNode,
    CommanderConflict,
    EscCondition,
    EscConflict,
    NodeHealth,
    NodeIdConflict,
)
from drivers.readings import (
    AutopilotClock,
    AutopilotConflict,
    AutopilotHeartbeat,
    AutopilotReboot,
    CommandAcknowledgement,
    IdentityConflict,
    OperatorRequest,
    Reading,
    ThrusterCommand,
    ThrusterReport,
)

HEARD, SAID, NOW, GAPS = "/mavlink/heard", "/mavlink/said", "/gateway/now", "/gateway/not_recorded"
FINDINGS, LOG = "/findings", "/log"
SPEED, NAVIGATION = "/vehicle/speed", "/navigation"
CAN, FD, EVENTS = "/can/", "/fd", "/events/"

# Of decoded readings; those that are not here are of the vehicle
_DECODED: dict[type[Reading], str] = {
    ThrusterCommand: "/thruster/{number}/command",
    ThrusterReport: "/thruster/{number}/report",
    EscCondition: "/thruster/{number}/condition",
    EscConflict: "/thruster/{number}/conflict",
    NodeHealth: "/bus/{link}/node_health",
    CommanderConflict: "/bus/{link}/commander_conflict",
    NodeIdConflict: "/bus/{link}/node_id_conflict",
    BabblingNode: "/bus/{link}/babbling_node",
    AutopilotHeartbeat: "/autopilot/heartbeat",
    AutopilotReboot: "/autopilot/reboot",
    AutopilotConflict: "/autopilot/conflict",
    AutopilotClock: "/autopilot/clock",
    CommandAcknowledgement: "/autopilot/acknowledgement",
    IdentityConflict: "/mavlink/identity_conflict",
    OperatorRequest: "/operator/request",
}
_WORD = re.compile(r"(?<!^)(?=[A-Z])")


def can_topic(bus: str, fd: bool) -> str:
    """Frames of a bus; those of CAN FD, which are longer, have a channel of their own."""
    return f"{CAN}{bus}{FD if fd else ''}"


def bus_of(topic: str) -> tuple[str, bool]:
    """Bus of such a topic, and whether it is that of its CAN FD frames."""
    bus = topic.removeprefix(CAN)
    return bus.removesuffix(FD), bus.endswith(FD)


def event_topic(link: str, kind: type[Reading]) -> str:
    """Readings that no decoder has made."""
    return f"{EVENTS}{link}/{kind.__name__}"


def decoded_topic(kind: type[Reading], link: str, number: int | None) -> str:
    """Decoded readings of a class. `number`: of the thruster, or barometer, that they are of."""
    template = _DECODED.get(kind, f"/vehicle/{_WORD.sub('_', kind.__name__).lower()}")
    if number is not None and "{number}" not in template:
        template += "/{number}"
    return template.format(link=link, number=number)


def verdict_topic(thruster: int) -> str:
    """What the detector said of a thruster."""
    return f"/thruster/{thruster}/verdict"
