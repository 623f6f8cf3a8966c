"""Asks the autopilot for what should be done about faults, one step at a time, by the table of `intervention_table`.

Nothing is asked of an autopilot that is not armed, is not heard, is not known, or is in a failsafe of its own
(advise, do not compete); no action again within `interval_s`; and never a mode against whoever changed it after us.
What is asked is announced first, answered or sent again (`drivers.mavlink.command_exchange`), and believed when the
HEARTBEAT shows it; if it does not, the next action of the plan is asked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from drivers.mavlink.command_exchange import CommandExchange, Ended
from drivers.mavlink.messages import CommandLong, StatusText
from drivers.readings import AutopilotHeartbeat, CommandAcknowledgement
from gateway.findings import Finding
from gateway.supervision import intervention_words as words
from gateway.supervision.actions import RANK, Action, Plan
from gateway.supervision.autopilots import REQUESTS, AutopilotWatch, Request, kind_of
from gateway.supervision.choice import Choice
from gateway.supervision.intervention_table import TABLE, Effect, Happening, State
from gateway.supervision.modes import Modes

# HEARTBEAT comes once a second, and may be late or lost
CONFIRM_S = 5.0
# a step may lead to another at once; more of them would be a circle
STEPS_MAX = 8

Outcome = Finding | StatusText | CommandLong


class Intervention:
    """One request at a time. See the module's text.

    Args:
        autopilot: kept up to date by the caller.
        delay_s: between announcing and asking, for the pilot to prevent it; 0 = none.
        interval_s: an action is never asked again sooner than this.

    Attributes:
        state: where it stands.

    Raises:
        ValueError: a negative time.
    """

    def __init__(self, autopilot: AutopilotWatch, delay_s: float = 5.0, interval_s: float = 60.0) -> None:
        for name, value in (("delay_s", delay_s), ("interval_s", interval_s)):
            if not value >= 0.0:
                raise ValueError(f"{name} = {value!r}: want 0 or more seconds")
        self.state = State.IDLE
        self._autopilot = autopilot
        self._delay_s, self._choice = delay_s, Choice(interval_s)
        self._plan: Plan | None = None
        self._reset()

    def _reset(self) -> None:
        self._label = ""
        self._action = Action.NONE
        self._rank = 0
        self._tried: set[Action] = set()
        self._due_s = math.inf
        self._exchange: CommandExchange | None = None
        self._sent_s = self._accepted_s = math.inf
        self._modes = Modes()

    def update(self, time_s: float, plan: Plan | None, all_well: bool) -> list[Outcome]:
        """Takes what should be done now, and goes on.

        Args:
            time_s: now.
            plan: None: nothing.
            all_well: no fault lasts, not even one for which nothing is to be done.
        """
        self._plan = plan
        if plan is not None and self._label:
            self._label = plan.label  # what it is for may be another by now
        outcomes = self._step(time_s, all_well)
        if self.state is State.ASKED and self._exchange is not None:  # still so, after all that is known by now
            again = self._exchange.advance(time_s)
            self._sent_s = self._sent_s if again is None else time_s
            outcomes += [again] if again is not None else self._step(time_s, all_well)
        return outcomes

    def heartbeat(self, reading: AutopilotHeartbeat) -> None:
        """Takes a HEARTBEAT, after the watch had it."""
        self._modes.heartbeat(reading.custom_mode)

    def acknowledge(self, reading: CommandAcknowledgement) -> None:
        """Takes a COMMAND_ACK."""
        if self._exchange is not None:
            self._exchange.acknowledge(reading)

    def resume(self, old: Intervention) -> None:
        """After a restart of the program: what had been asked is not asked again, what had only been announced is."""
        self._choice.resume(old._choice)
        under_way = old.state in (State.REFRAINED, State.COUNTDOWN, State.ASKED, State.CONFIRMING)
        if under_way and not old._modes.acted:
            return
        self.state = State.SPENT if under_way else old.state
        self._action, self._rank, self._label, self._tried = old._action, old._rank, old._label, old._tried
        self._modes = old._modes

    def _step(self, time_s: float, all_well: bool) -> list[Outcome]:
        """Makes the steps of the table that are due."""
        outcomes: list[Outcome] = []
        for _ in range(STEPS_MAX):
            happening = self._happening(time_s, all_well)
            if happening is None:
                break
            step = TABLE[self.state, happening]
            outcomes += self._do(step.effect, happening, time_s)
            self.state = step.state
        return outcomes

    # What has happened --------------------------------------------------------------------------

    def _happening(self, time_s: float, all_well: bool) -> Happening | None:
        """The weightiest of what has happened that the present state knows."""
        heard = self._autopilot.present(time_s)
        first, obstacle = self._first(time_s, heard)
        failed = self._failed(heard)
        holds = {
            Happening.SHOWN: heard is not None and self._shown(heard),
            Happening.DISARMED: self._autopilot.armed is False,
            Happening.TAKEN_OVER: heard is not None and self._modes.overridden(heard.custom_mode, self._stands),
            Happening.ALL_WELL: all_well,
            Happening.UNWANTED: self._plan is None,
            Happening.ALREADY: heard is not None and obstacle in ("", words.JUST_NOW) and self._already(first, heard),
            Happening.BLOCKED: self._plan is not None and self._blocks(obstacle),
            Happening.WORSE: not obstacle and RANK[first] > self._rank,
            Happening.USELESS: not obstacle and self._useless(first, heard),
            Happening.OTHER: not obstacle and first not in (Action.NONE, self._action),
            Happening.EXHAUSTED: failed and self._next(time_s, heard) is Action.NONE,
            Happening.HARSHER: failed and self._delay_s > 0.0 and RANK[self._next(time_s, heard)] > self._rank,
            Happening.FAILED: failed,
            Happening.ACCEPTED: self._exchange is not None and self._exchange.ended is Ended.ACCEPTED,
            Happening.DUE: heard is not None and heard.time_s >= self._due_s,
            Happening.WANTED: not obstacle and first is not Action.NONE,
        }
        return next((one for one in Happening if (self.state, one) in TABLE and holds[one]), None)

    def _first(self, time_s: float, heard: AutopilotHeartbeat | None) -> tuple[Action, str]:
        """The action to ask for, and why it cannot be asked now ("" = it can)."""
        if self._plan is None or self._autopilot.armed is False:
            return Action.NONE, ""
        tried = self._tried if self.state is State.COUNTDOWN else ()  # of a fallback's
        return self._choice.first(self._plan, heard, time_s, tried)

    def _next(self, time_s: float, heard: AutopilotHeartbeat | None) -> Action:
        return self._choice.next(self._plan, heard, time_s, self._tried)

    def _blocks(self, obstacle: str) -> bool:
        """Of what is asked, that it was asked just now is no obstacle; of what was accepted, only silence is one."""
        if self.state is State.CONFIRMING:
            return obstacle == words.NOT_HEARD
        wanted = self._plan is not None and self._action in self._plan.actions
        return bool(obstacle) and not (self.state is State.ASKED and wanted and obstacle == words.JUST_NOW)

    def _useless(self, first: Action, heard: AutopilotHeartbeat | None) -> bool:
        """What was asked relies on something that has failed since, and there is something that does not."""
        if heard is None or self._plan is None or first is Action.NONE:
            return False
        request = self._request(heard)
        mistrusted = request is not None and not self._position_trusted and heard.custom_mode in request.as_good
        return self._action not in self._plan.actions or (self._stands and mistrusted)

    def _request(self, heard: AutopilotHeartbeat) -> Request | None:
        return REQUESTS.get((kind_of(heard), self._action))

    def _shown(self, heard: AutopilotHeartbeat) -> bool:
        request = self._request(heard)
        if request is None:
            return False
        if not request.modes:
            return self.state is not State.COUNTDOWN and request.ended(heard)
        gone_on = heard.custom_mode in request.after and heard.time_s > self._accepted_s
        return gone_on or heard.custom_mode in request.good(self._position_trusted)

    def _already(self, action: Action, heard: AutopilotHeartbeat) -> bool:
        """Whether there is nothing to ask for: the autopilot is in a mode that does it."""
        request = REQUESTS.get((kind_of(heard), action))
        return request is not None and heard.custom_mode in request.good(self._position_trusted)

    @property
    def _stands(self) -> bool:
        return self.state is State.STANDING

    @property
    def _position_trusted(self) -> bool:
        return self._plan is None or self._plan.position_trusted

    def _failed(self, heard: AutopilotHeartbeat | None) -> bool:
        """Refused; or when its time is over, a HEARTBEAT shows that it did not come about. Silence shows nothing."""
        ended = None if self._exchange is None else self._exchange.ended
        if ended is Ended.REFUSED or heard is None:
            return ended is Ended.REFUSED
        if self.state is State.CONFIRMING:
            return heard.time_s >= self._due_s
        return ended is Ended.UNANSWERED and heard.time_s > self._sent_s

    # What is done ---------------------------------------------------------------------------------

    def _do(self, effect: Effect, happening: Happening, time_s: float) -> Iterator[Outcome]:
        heard = self._autopilot.present(time_s)
        match effect:
            case Effect.ANNOUNCE | Effect.CHANGE if heard is not None:
                yield from self._announce(time_s, heard, restart=effect is Effect.ANNOUNCE)
            case Effect.REFRAIN:
                yield from self._refrain(time_s, heard)
            case Effect.CANCEL:
                why = str(happening) if happening is Happening.DISARMED else ""
                yield from words.cancelled(time_s, self._action, why, self._label)
                self._reset()
            case Effect.RECALL:
                yield from words.recalled(time_s, self._action, self._label)
                self._reset()
            case Effect.ASK | Effect.FALL_BACK if heard is not None:
                yield from self._ask(effect, time_s, heard)
            case Effect.AWAIT:
                self._accepted_s, self._due_s = time_s, time_s + CONFIRM_S
                self._exchange = None
            case Effect.POSTPONE:
                following = self._next(time_s, heard)
                yield from words.postponed(time_s, self._action, self._word(), following, self._delay_s, self._label)
                self._action, self._rank = following, RANK[following]
                self._exchange, self._due_s, self._accepted_s = None, time_s + self._delay_s, math.inf
            case Effect.ADOPT if heard is not None:
                self._reset()
                self._action, _ = self._first(time_s, heard)
                self._rank, self._label = RANK[self._action], "" if self._plan is None else self._plan.label
                yield from self._done(time_s, heard)
            case Effect.GIVE_UP:
                yield from words.given_up(time_s, self._action, self._word(), self._label)
                self._exchange, self._due_s = None, math.inf
            case Effect.DONE if heard is not None:
                yield from self._done(time_s, heard)
            case Effect.YIELD:
                yield from words.yielded(time_s)
                self._exchange, self._due_s = None, math.inf
            case Effect.END:
                self._reset()

    def _announce(self, time_s: float, heard: AutopilotHeartbeat, restart: bool) -> Iterator[Outcome]:
        action, _ = self._first(time_s, heard)
        due_s = self._due_s
        if restart:  # what counts is a HEARTBEAT from after the delay: the pilot's mode change shows in the next one
            due_s = time_s + self._delay_s if self._delay_s > 0.0 else -math.inf
        modes = self._modes
        modes.announced(heard.custom_mode, self._request(heard) if self._stands else None)
        self._reset()
        self._modes = modes
        self._action, self._rank, self._due_s = action, RANK[action], due_s
        self._label = "" if self._plan is None else self._plan.label
        if due_s > -math.inf:
            yield from words.announced(time_s, action, max(0.0, due_s - time_s), self._label)

    def _refrain(self, time_s: float, heard: AutopilotHeartbeat | None) -> Iterator[Outcome]:
        action, obstacle = self._first(time_s, heard)
        if not self._modes.acted:
            self._reset()
        self._exchange, self._due_s = None, math.inf  # modes stay: what was asked may come about, or be overridden
        yield from words.refrained(time_s, action, obstacle)

    def _ask(self, effect: Effect, time_s: float, heard: AutopilotHeartbeat) -> Iterator[Outcome]:
        if effect is Effect.FALL_BACK:
            action, self._action = self._action, self._next(time_s, heard)
            if self._already(self._action, heard):  # nothing to ask: that it is so is seen in the next step
                yield from words.failed(time_s, action, self._word())
                self._exchange = None
                return
            yield from words.fell_back(time_s, action, self._word(), self._action, self._label)
        request = REQUESTS[kind_of(heard), self._action]
        command = request.message(heard)
        self._exchange = CommandExchange(command, time_s, self._exchange)
        self._sent_s, self._accepted_s, self._due_s = time_s, math.inf, math.inf
        self._tried.add(self._action)
        self._modes.asked(request)
        self._choice.asked(self._action, time_s)
        yield words.asked(time_s, self._action, self._label)
        yield command

    def _done(self, time_s: float, heard: AutopilotHeartbeat) -> Iterator[Outcome]:
        already = self._action not in self._tried
        self._modes.came_about(self._request(heard), self._position_trusted)
        self._exchange, self._due_s = None, math.inf
        yield from words.done(time_s, self._action, self._label, already)

    def _word(self) -> str:
        return "did not come" if self._exchange is None else self._exchange.word
