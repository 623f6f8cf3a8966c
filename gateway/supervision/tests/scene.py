"""An autopilot as its HEARTBEAT shows it, and an intervention with it, moved only by what happens to them."""

from __future__ import annotations

from drivers.mavlink.messages import CommandLong, StatusText
from drivers.readings import AutopilotHeartbeat, CommandAcknowledgement
from gateway.supervision.actions import Action, Plan
from gateway.supervision.autopilots import (
    MAV_AUTOPILOT_ARDUPILOT,
    MAV_TYPE_SUBMARINE,
    AutopilotWatch,
)
from gateway.supervision.intervention import Intervention
from gateway.supervision.intervention_table import State

DELAY_S, INTERVAL_S = 5.0, 60.0
ACTIVE, OWN_FAILSAFE = 4, 5
STABILIZE, ACRO, ALT_HOLD, SURFACE, POSHOLD, MANUAL = 0, 1, 2, 9, 16, 19
ACCEPTED, TEMPORARILY_REJECTED, DENIED, IN_PROGRESS = 0, 1, 2, 5


def heartbeat(
    time_s: float,
    mode: int = STABILIZE,
    armed: bool = True,
    status: int = ACTIVE,
    autopilot: int = MAV_AUTOPILOT_ARDUPILOT,
    vehicle: int = MAV_TYPE_SUBMARINE,
) -> AutopilotHeartbeat:
    return AutopilotHeartbeat(time_s, 1, 1, autopilot, vehicle, armed, mode, status)


class Scene:
    """ArduSub, armed, in STABILIZE; a plan that can be changed; what came of it."""

    def __init__(self, *actions: Action, delay_s: float = DELAY_S, autopilot: int = MAV_AUTOPILOT_ARDUPILOT) -> None:
        self.watch = AutopilotWatch()
        self.intervention = Intervention(self.watch, delay_s, INTERVAL_S)
        self.time_s, self.all_well = 100.0, False
        self.mode, self.armed, self.status, self.autopilot = STABILIZE, True, ACTIVE, autopilot
        self.plan: Plan | None = None
        self.outcomes: list[object] = []
        self.beat()
        if actions:
            self.want(*actions)

    @property
    def state(self) -> State:
        return self.intervention.state

    @property
    def texts(self) -> list[StatusText]:
        return [one for one in self.outcomes if isinstance(one, StatusText)]

    @property
    def said(self) -> str:
        return self.texts[-1].text if self.texts else ""

    @property
    def commands(self) -> list[CommandLong]:
        return [one for one in self.outcomes if isinstance(one, CommandLong)]

    @property
    def modes_asked(self) -> list[float]:
        return [command.parameters[1] for command in self.commands]

    def update(self) -> None:
        self.outcomes += self.intervention.update(self.time_s, self.plan, self.all_well)

    def want(self, *actions: Action, left_out: str = "", position_trusted: bool = True) -> None:
        self.plan = Plan("T3", actions, left_out, position_trusted)
        self.update()

    def want_nothing(self, all_well: bool = False) -> None:
        self.plan, self.all_well = None, all_well
        self.update()

    def beat(self, mode: int | None = None, armed: bool | None = None, status: int | None = None) -> None:
        self.mode = self.mode if mode is None else mode
        self.armed = self.armed if armed is None else armed
        self.status = self.status if status is None else status
        reading = heartbeat(self.time_s, self.mode, self.armed, self.status, self.autopilot)
        self.watch.ambiguous = False
        self.watch.heartbeat(reading)
        self.intervention.heartbeat(reading)
        self.update()

    def wait(self, seconds: float) -> None:
        """Heard all the time."""
        self.time_s += seconds
        self.beat()

    def silence(self, seconds: float) -> None:
        """Not heard."""
        self.time_s += seconds
        self.update()

    def two(self) -> None:
        """A second autopilot is heard."""
        self.watch.ambiguous = True

    def answer(self, result: int, command: int = 176, component_id: int = 1) -> None:
        self.intervention.acknowledge(CommandAcknowledgement(self.time_s, 1, component_id, command, result, 255))
        self.update()

    def reach(self, state: State) -> Scene:
        """Goes from where nothing was wanted to a state, by what leads there."""
        if state is State.IDLE:
            return self
        self.want(Action.HOLD, Action.MANUAL)
        if state is State.YIELDED:
            self.beat(mode=ACRO)
        elif state is not State.COUNTDOWN:
            self.wait(DELAY_S)
            self._on_from_asked(state)
        assert self.state is state
        self.outcomes.clear()
        return self

    def _on_from_asked(self, state: State) -> None:
        if state is State.REFRAINED:
            self.beat(status=OWN_FAILSAFE)
        elif state is State.SPENT:
            self.want(Action.HOLD)
            self.answer(DENIED)
        elif state in (State.CONFIRMING, State.STANDING):
            self.answer(ACCEPTED)
            if state is State.STANDING:
                self.wait(1.0)
                self.beat(mode=ALT_HOLD)
