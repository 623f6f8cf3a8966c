"""How a scenario is played: where the vehicle is, where the gateway, and at whose pace."""

from __future__ import annotations

from dataclasses import dataclass

from hil_tests.bridge.permission import Granted


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """See the module's text; nothing said: in virtual time, all in memory.

    Attributes:
        realtime: at the pace of the clock.
        channel: a SocketCAN interface that the vehicle's nodes are on, in real time; None: it is in memory.
        program: there, the gateway is a program of its own, as on the vehicle; else it is in this one, which spares a
            slow machine to load it anew for each scenario.
        autopilot: endpoint of a real one, or of its simulator; with a channel, ESCs and sensors are played to it,
            else the link is bridged; None: it is simulated.
        bridge: two SocketCAN interfaces of a real vehicle, that of its autopilot first, to be in the middle of; None:
            the ESCs are simulated.
        gateway: endpoint of one that runs elsewhere, where something is bridged; None: one is started here.
        granted: what may be touched of what is not virtual.

    Raises:
        ValueError: what does not go together.
    """

    realtime: bool = False
    channel: str | None = None
    program: bool = True
    autopilot: str | None = None
    bridge: tuple[str, str] | None = None
    gateway: str | None = None
    granted: Granted = Granted()  # noqa: RUF009  frozen

    def __post_init__(self) -> None:
        for option, named in (("--can", self.channel), ("--mavlink", self.autopilot), ("--gateway", self.gateway)):
            if named == "":
                raise ValueError(f"{option} has nothing behind it: want a name, or leave {option} out")
        if self.channel is not None and self.bridge is not None:
            raise ValueError("a bus is bridged, or nodes are played onto it: want --can or --bridge, not both")
        if self.gateway is not None and not self.is_bridged:
            raise ValueError("a gateway that runs elsewhere is reached over a bridge: --gateway goes with --bridge")
        if self.gateway is not None and self.autopilot is None:
            raise ValueError(f"a bridge to {self.gateway} has two ends: say where the autopilot is, with --mavlink")

    @property
    def is_bridged(self) -> bool:
        """Whether it is in the middle of real hardware."""
        return self.bridge is not None or (self.autopilot is not None and self.channel is None)

    @property
    def is_virtual(self) -> bool:
        """Whether time is."""
        return not (self.realtime or self.is_bridged or self.channel)

    def __str__(self) -> str:
        if self.is_virtual:
            return "virtual time"
        if self.is_bridged:
            return "between " + " and ".join(filter(None, [":".join(self.bridge or ()), self.autopilot]))
        if self.channel is None:
            return "real time in memory"
        return f"real time on {self.channel}" + (f", autopilot at {self.autopilot}" if self.autopilot else "")


VIRTUAL = Way()
