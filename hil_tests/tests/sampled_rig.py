"""An autopilot that forwards its CAN bus over a link that loses frames, and the gateway's pure half behind it.

No socket, no clock: at the speed of the processor, all by the real parts. What is left out is the shell.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

from drivers.can.frame import CanFrame
from drivers.mavlink.encoder import MavlinkEncoder, frames_of
from drivers.readings import LinkState, Reading
from gateway.config import Config
from gateway.findings import Finding
from gateway.forwarded_bus import ForwardedBus
from gateway.pipeline import Factories, Outcome, Pipeline
from gateway.wiring import mavlink_decoder
from hil_tests.rig.commander import Commander
from hil_tests.rig.mavlink_autopilot import MavlinkAutopilot
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import Motion

START_S = 1_700_000_000.0
PERIOD_S = 0.02
LATENCY_S = 0.002

Frames = Callable[[int], Sequence[CanFrame]]


class Losses:
    """Loses frames at random, one by one or in bursts.

    Args:
        share: of the frames, or of the time.
        seed: of the chance.
        burst_s: mean length of a burst; 0: one by one.
    """

    def __init__(self, share: float, seed: int = 0, burst_s: float = 0.0) -> None:
        self._share, self._burst_s = share, burst_s
        self._random = random.Random(seed)
        self._losing, self._until_s = True, -1.0

    def __call__(self, time_s: float) -> bool:
        """Whether a frame of this time finds room."""
        if not self._burst_s:
            return self._random.random() >= self._share
        while time_s >= self._until_s:
            self._losing = not self._losing
            mean_s = self._burst_s * (1.0 if self._losing else 1.0 / self._share - 1.0)
            self._until_s = max(self._until_s, time_s) + self._random.expovariate(1.0 / mean_s)
        return not self._losing


class SampledRig:
    """Everything, stepped together.

    Args:
        config: of the gateway, with a bus that is forwarded.
        commander: of the autopilot.
        frames: see below.
        factories: of the detectors; None: the real ones.
        can_buses: of the autopilot.

    Attributes:
        time_s: now.
        frames: of the n-th step on the autopilot's CAN1.
        autopilot: the vehicle's.
        bus: the gateway's view of the autopilot's.
        findings: what the gateway has found.
        judged: samples of thrusters so far.
        cut: nothing comes from the autopilot any more.
    """

    def __init__(
        self,
        config: Config,
        commander: Commander,
        frames: Frames,
        factories: Factories | None = None,
        can_buses: int = 2,
    ) -> None:
        self.time_s = START_S
        self.autopilot = MavlinkAutopilot(self._put, commander, can_buses=can_buses)
        self.bus = ForwardedBus(config.can[0], config, self._take)
        self.findings: list[Finding] = []
        self.judged = 0
        self.cut = False
        self.frames, self._n = frames, 0
        self._datagrams: list[bytes] = []
        self._decoder = mavlink_decoder(config.mavlink, config.thruster, can_frames=self.bus.frames)
        self._encoder = MavlinkEncoder(1)
        self._pipeline = Pipeline(config, factories)

    @property
    def texts(self) -> list[str]:
        """What was found, but for what is well."""
        return [one.text for one in self.findings if one.level.name != "NORMAL"]

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds / PERIOD_S)):
            self.step()

    def step(self) -> None:
        """Let 20 ms pass."""
        self.time_s += PERIOD_S
        self.autopilot.advance(self.time_s, Telemetry(self.time_s - START_S + 10.0, Motion(), [0.0]))
        for place, frame in enumerate(self.frames(self._n)):
            self.autopilot.on_bus(self.time_s + 1e-4 * place, 1, frame)
        self._n += 1
        self._hear(self._decoder.decode(self._arrived(), self.time_s + LATENCY_S))
        self._note(self._pipeline.advance(self.time_s + LATENCY_S))

    def link(self, up: bool) -> None:
        """The MAVLink link comes up or goes down, as its driver says."""
        state = LinkState(self.time_s, "mavlink", up, "" if up else "silent for 6 s")
        self._note(self._pipeline.feed("mavlink", [state]))
        self._hear([state])

    def _arrived(self) -> bytes:
        datagrams, self._datagrams = self._datagrams, []
        return b"" if self.cut else b"".join(datagrams)

    def _hear(self, readings: Sequence[Reading]) -> None:
        now_s = self.time_s + LATENCY_S
        if readings and not isinstance(readings[0], LinkState):
            self._take("mavlink", readings)
        for message in self.bus.update(readings, now_s):
            for frame in frames_of(self._encoder.encode(message)):
                self.autopilot.receive(self.time_s, frame)
        state = self.bus.state(now_s)
        if state is not None:
            self._take(state.link, [state])

    def _put(self, datagram: bytes) -> None:
        self._datagrams.append(datagram)

    def _take(self, link: str, readings: Sequence[Reading]) -> None:
        self._note(self._pipeline.feed(link, readings))

    def _note(self, outcomes: Sequence[Outcome]) -> None:
        self.findings += [one for one in outcomes if isinstance(one, Finding)]
        self.judged += sum(type(one).__name__ == "ThrusterJudgement" for one in outcomes)
