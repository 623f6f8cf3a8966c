"""A CAN bus of the autopilot, read over MAVLink: asked for, decoded and told like one that is read directly.

What arrives is a sample of the bus: no load is measured, and no frame is missed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from drivers.can.frame import CanFilter, CanFrame
from drivers.mavlink.can_filter import forwarding_ids
from drivers.mavlink.can_forward import CanForward
from drivers.mavlink.forwarded_frames import ForwardedFrames
from drivers.mavlink.messages import CanFilterModify, CommandLong
from drivers.readings import LinkState, Reading, ThrusterReport
from gateway.config import Config
from gateway.config_sections import CanBus
from gateway.torn_speeds import TornSpeeds
from gateway.wiring import can_decoder

Take = Callable[[str, Sequence[Reading]], None]


class ForwardedDecoder:
    """Frames that an autopilot has forwarded to readings, live and of a log.

    Args:
        bus: of the configuration.
        config: the rest of it.

    Attributes:
        frames: for the decoder of the MAVLink link to fill.
    """

    def __init__(self, bus: CanBus, config: Config) -> None:
        self._drops: Counter[str] = Counter()
        self.frames = ForwardedFrames(self._drops)
        self._decoder = can_decoder(bus, config.thruster)
        self._speeds = {one.number: TornSpeeds(config.alignment(one).gap_s) for one in config.thruster}

    def filters(self) -> list[CanFilter]:
        """The frames that are wanted."""
        return self._decoder.filters()

    def decode(self, frames: Iterable[CanFrame]) -> list[Reading]:
        """What these frames complete."""
        return [reading for frame in frames for reading in self._decoder.decode(frame) if self._is_whole(reading)]

    def drops(self) -> Counter[str]:
        """What was thrown away, by cause."""
        return self._decoder.drops + self._drops

    def _is_whole(self, reading: Reading) -> bool:
        if not isinstance(reading, ThrusterReport) or self._speeds[reading.thruster].admits(reading):
            return True
        self._drops["speed after losses"] += 1
        return False


class ForwardedBus:
    """See the module's text.

    Args:
        bus: of the configuration.
        config: the rest of it.
        take: gets the readings.

    Attributes:
        name: of the bus, in the configuration.
        frames: for the decoder of the MAVLink link to fill.
        received: frames of the bus so far.
    """

    def __init__(self, bus: CanBus, config: Config, take: Take) -> None:
        self.name = bus.name
        self.received = 0
        self._decoder = ForwardedDecoder(bus, config)
        self.frames = self._decoder.frames
        self._forward = CanForward(bus.name, int(bus.channel), forwarding_ids(self._decoder.filters()))
        self._take = take

    def update(self, readings: Iterable[Reading], time_s: float) -> list[CommandLong | CanFilterModify]:
        """Takes what the MAVLink link brought, frames included; what to send now. At least once a second."""
        frames = self._forward.frames(self.frames.take())
        self.received += len(frames)
        decoded = self._decoder.decode(frames)
        if decoded:
            self._take(self.name, decoded)
        return self._forward.update(readings, time_s)

    def state(self, time_s: float) -> LinkState | None:
        """How the bus is, where that has changed since the last time."""
        return self._forward.state(time_s)

    def stop(self, time_s: float) -> list[CommandLong | CanFilterModify]:
        """What ends the forwarding."""
        return self._forward.stop(time_s)

    def drops(self) -> Counter[str]:
        """What was thrown away, by cause."""
        return self._decoder.drops() + self._forward.drops

    def decode_errors(self) -> Counter[str]:
        """That of it which the decoder threw away."""
        return self._decoder.drops()


def forwarded_buses(config: Config, take: Take) -> list[ForwardedBus]:
    """Of this configuration: one at most, for an autopilot forwards one of its buses at a time."""
    return [ForwardedBus(bus, config, take) for bus in config.can if bus.forwarded]
