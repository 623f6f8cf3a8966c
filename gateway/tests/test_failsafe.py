"""What is asked of which autopilot, how often, and what is told of the answer."""

import pytest

from detectors.verdict import Level
from drivers.mavlink.messages import CommandLong, StatusText
from drivers.readings import AutopilotHeartbeat, CommandAcknowledgement
from gateway.failsafe import Failsafe
from gateway.findings import Finding
from gateway.supervision.autopilots import AutopilotWatch

ARDUSUB, ROVER, PX4, OTHER = (3, 12), (3, 10), (12, 12), (0, 12)
ACCEPTED, TEMPORARILY_REJECTED, DENIED, IN_PROGRESS = 0, 1, 2, 5


def autopilot(kind: tuple[int, int] = ARDUSUB, armed: bool = True, status: int = 4) -> AutopilotWatch:
    watch = AutopilotWatch()
    watch.heartbeat(AutopilotHeartbeat(0.0, 7, 1, *kind, armed, 19, status))
    return watch


def commands(actions: list) -> list[CommandLong]:
    return [action for action in actions if isinstance(action, CommandLong)]


def said(actions: list) -> list[str]:
    return [action.text for action in actions if isinstance(action, StatusText)]


def recorded(actions: list) -> list[tuple[Level, str]]:
    return [(action.level, action.text) for action in actions if isinstance(action, Finding)]


def answer(time_s: float, result: int, command: int = 176, system: int = 7) -> CommandAcknowledgement:
    return CommandAcknowledgement(time_s, system, 1, command, result, 255)


@pytest.mark.parametrize(
    ("kind", "action", "command"),
    [
        (ARDUSUB, "hold", (176, 1.0, 2.0)),
        (ARDUSUB, "surface", (176, 1.0, 9.0)),
        (ARDUSUB, "manual", (176, 1.0, 19.0)),
        (ARDUSUB, "disarm", (400, 0.0, 0.0)),
        (PX4, "hold", (176, 1.0, 2.0)),
        (PX4, "manual", (176, 1.0, 1.0)),
        (PX4, "disarm", (400, 0.0, 21196.0)),
    ],
)
def test_command_of_each_action(kind, action, command):
    (sent,) = commands(Failsafe().request(1.0, "T3", action, autopilot(kind)))
    assert (sent.command, *sent.parameters[:2]) == command
    assert (sent.target_system, sent.target_component, sent.confirmation) == (7, 1, 0)


@pytest.mark.parametrize("action", ["none", "warn"])
def test_nothing_is_asked_by_default(action):
    assert Failsafe().request(1.0, "T3", action, autopilot()) == []


@pytest.mark.parametrize(
    ("watch", "reason", "told"),
    [
        (autopilot(armed=False), "not armed", False),
        (AutopilotWatch(), "autopilot not heard", False),
        (autopilot(OTHER), "autopilot 0 unknown", True),
        (autopilot(ROVER), "autopilot 3 unknown", True),
        (autopilot(PX4), "PX4 has none", True),
        (autopilot(status=5), "own failsafe active", True),
    ],
)
def test_not_sent_and_said_so(watch, reason, told):
    actions = Failsafe().request(1.0, "T3", "surface", watch)
    assert commands(actions) == []
    text = f"T3 failsafe surface: not sent, {reason}"
    assert recorded(actions) == [(Level.UNKNOWN, text)]
    assert said(actions) == ([text] if told else [])


def test_autopilot_that_fell_silent_is_not_asked():
    actions = Failsafe().request(5.1, "T3", "hold", autopilot())
    assert recorded(actions) == [(Level.UNKNOWN, "T3 failsafe hold: not sent, autopilot not heard")]


def test_accepted_is_told_and_recorded():
    failsafe = Failsafe()
    asked = failsafe.request(1.0, "T3", "surface", autopilot())
    assert recorded(asked) == [(Level.SUSPECT, "T3 failsafe surface: asked")]
    actions = failsafe.acknowledge(answer(1.008, ACCEPTED))
    assert said(actions) == ["T3 failsafe surface: accepted"]
    assert recorded(actions) == [(Level.NORMAL, "T3 failsafe surface: accepted")]
    assert failsafe.advance(9.0) == []


def test_three_tries_a_second_apart_then_no_answer():
    failsafe = Failsafe()
    sent = [(0.0, command.confirmation) for command in commands(failsafe.request(0.0, "T3", "hold", autopilot()))]
    given_up = []
    for tick in range(1, 60):
        actions = failsafe.advance(tick / 10)
        sent += [(tick / 10, command.confirmation) for command in commands(actions)]
        given_up += [(tick / 10, text) for text in said(actions)]
    assert sent == [(0.0, 0), (1.0, 1), (2.0, 2)]
    assert given_up == [(3.0, "T3 failsafe hold: no answer")]


def test_refusal_is_not_tried_again():
    failsafe = Failsafe()
    failsafe.request(0.0, "T3", "hold", autopilot())
    assert said(failsafe.acknowledge(answer(0.1, DENIED))) == ["T3 failsafe hold: denied"]
    assert failsafe.advance(1.5) == []


def test_temporary_rejection_is_tried_again_and_progress_is_waited_for():
    failsafe = Failsafe()
    failsafe.request(0.0, "T3", "hold", autopilot())
    assert failsafe.acknowledge(answer(0.1, TEMPORARILY_REJECTED)) == []
    assert commands(failsafe.advance(1.0))
    assert failsafe.acknowledge(answer(1.5, IN_PROGRESS)) == []
    assert failsafe.advance(2.4) == []
    assert commands(failsafe.advance(2.5))


def test_foreign_acknowledgements_mean_nothing():
    failsafe = Failsafe()
    assert failsafe.acknowledge(answer(0.0, ACCEPTED)) == []
    failsafe.request(0.0, "T3", "hold", autopilot())
    assert failsafe.acknowledge(answer(0.1, ACCEPTED, command=511)) == []
    assert failsafe.acknowledge(answer(0.1, ACCEPTED, system=8)) == []
    assert said(failsafe.acknowledge(answer(0.2, ACCEPTED)))


def test_never_asked_again_within_the_interval():
    failsafe = Failsafe(interval_s=3.0)
    failsafe.request(0.0, "T3", "hold", autopilot())
    failsafe.acknowledge(answer(0.1, ACCEPTED))
    second = failsafe.request(2.9, "T5", "hold", autopilot())
    assert commands(second) == [] and said(second) == []
    assert recorded(second) == [(Level.UNKNOWN, "T5 failsafe hold: not sent, asked just now")]
    assert commands(failsafe.request(3.0, "T6", "hold", autopilot()))


def test_each_request_has_its_own_action_and_its_own_name():
    failsafe = Failsafe(interval_s=0.0)
    failsafe.request(0.0, "T3", "hold", autopilot())
    assert said(failsafe.acknowledge(answer(0.1, ACCEPTED))) == ["T3 failsafe hold: accepted"]
    (sent,) = commands(failsafe.request(1.0, "Speed", "surface", autopilot()))
    assert sent.parameters[1] == 9.0
    assert said(failsafe.acknowledge(answer(1.1, ACCEPTED))) == ["Speed failsafe surface: accepted"]


@pytest.mark.parametrize("interval_s", [-1.0, float("nan")])
def test_interval_is_checked(interval_s):
    with pytest.raises(ValueError, match="interval_s"):
        Failsafe(interval_s)
