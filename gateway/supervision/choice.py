"""Which action of a plan is asked for now, which comes next, and why none can be."""

from __future__ import annotations

import math
from collections.abc import Collection

from drivers.readings import AutopilotHeartbeat
from gateway.supervision import intervention_words as words
from gateway.supervision.actions import Action, Plan
from gateway.supervision.autopilots import OWN_FAILSAFE, REQUESTS, AutopilotKind, kind_of


class Choice:
    """Remembers when what was asked.

    Args:
        interval_s: an action is never asked again sooner than this.
    """

    def __init__(self, interval_s: float) -> None:
        self._interval_s = interval_s
        self._asked_s: dict[Action, float] = {}

    def asked(self, action: Action, time_s: float) -> None:
        """An action goes out."""
        self._asked_s[action] = time_s

    def resume(self, old: Choice) -> None:
        """After a restart of the program."""
        self._asked_s = old._asked_s

    def first(
        self, plan: Plan, heard: AutopilotHeartbeat | None, time_s: float, tried: Collection[Action] = ()
    ) -> tuple[Action, str]:
        """The action to ask for, and why it cannot be asked now ("" = it can).

        Args:
            plan: what should be done.
            heard: the autopilot; None: it is not heard.
            time_s: now.
            tried: what was tried and failed: it comes last.
        """
        wanted = plan.actions[0] if plan.actions else Action.NONE
        if heard is None:
            return wanted, words.NOT_HEARD
        kind = kind_of(heard)
        known = _known(plan, kind)
        obstacle = words.obstacle(kind, plan, heard.system_status in OWN_FAILSAFE, bool(known))
        known = [action for action in known if action not in tried] or known
        first = known[0] if known else wanted
        if not obstacle and self._just_now(first, time_s):
            obstacle = words.JUST_NOW
        return first, obstacle

    def next(
        self, plan: Plan | None, heard: AutopilotHeartbeat | None, time_s: float, tried: Collection[Action]
    ) -> Action:
        """The next action of the plan that was not tried; NONE = there is none, or nobody to ask."""
        if heard is None or plan is None or heard.system_status in OWN_FAILSAFE:
            return Action.NONE
        untried = (action for action in _known(plan, kind_of(heard)) if action not in tried)
        return next((action for action in untried if not self._just_now(action, time_s)), Action.NONE)

    def _just_now(self, action: Action, time_s: float) -> bool:
        return time_s - self._asked_s.get(action, -math.inf) < self._interval_s


def _known(plan: Plan, kind: AutopilotKind) -> list[Action]:
    return [action for action in plan.actions if (kind, action) in REQUESTS]
