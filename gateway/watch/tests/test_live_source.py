"""A gateway that answers, is gone, and is back."""

from dataclasses import replace

from gateway.control.tell import NoAnswerError
from gateway.watch.live_source import LiveSource
from gateway.watch.tests.scene import BEGIN_S, telemetry


class Gateway:
    """It answers with these, one after the other; with None not at all."""

    def __init__(self, *answers) -> None:
        self._answers, self.closed = list(answers), False

    def ask(self):
        answer = self._answers.pop(0)
        if answer is None:
            raise NoAnswerError("no gateway runs with this configuration")
        return answer

    def close(self) -> None:
        self.closed = True


def test_what_it_says_is_shown_with_the_time():
    source = LiveSource(Gateway(telemetry()), lambda: BEGIN_S + 60.0)
    look = source.look()
    assert (look.telemetry, look.state, look.fresh, look.time) == (telemetry(), "live", True, "2023-11-14T22:14:20Z")


def test_where_it_never_ran_there_is_nothing_to_show():
    look = LiveSource(Gateway(None), lambda: BEGIN_S).look()
    assert look.telemetry is None and not look.fresh and not look.ended
    assert look.state == "no gateway runs with this configuration; waiting for it"


def test_when_it_is_gone_the_last_is_shown_as_old_and_a_new_one_is_told_as_new():
    new = replace(telemetry(since_s=2.0), time_s=BEGIN_S + 95.0)
    older = replace(new, running_s=40.0, time_s=BEGIN_S + 133.0)
    source = LiveSource(Gateway(telemetry(), None, new, older), lambda: BEGIN_S + 90.0)
    source.look()
    gone = source.look()
    assert (gone.telemetry, gone.fresh, gone.note) == (telemetry(), False, "last seen 30 s ago")
    back = source.look()
    assert (back.telemetry, back.fresh, back.state) == (new, True, "live, started again")
    assert source.look().state == "live"


def test_closed_it_asks_no_more():
    gateway = Gateway()
    LiveSource(gateway, lambda: 0.0).close()
    assert gateway.closed
