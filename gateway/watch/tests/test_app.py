"""The watch on a terminal of some size: what is where, and what keys do."""

from threading import Event

import pytest
from textual.app import App, ComposeResult
from textual.widgets import Footer, Static

from gateway.watch.app import PlayerApp, WatchApp
from gateway.watch.lines import Lines
from gateway.watch.palette import COLOURED
from gateway.watch.source import Look
from gateway.watch.tests.scene import ENTANGLED, telemetry, thruster
from gateway.watch.view import Frame, link_lines

# the first look is at once, and further ones are given to the app by hand; but where looking itself is tested
EVERY_S, OFTEN_S = 3600.0, 0.05
MANY = telemetry(*(thruster(number) for number in range(4, 24)))


class Shown:
    """A source that always shows the same."""

    def __init__(self, look: Look) -> None:
        self.seen = look
        self.pressed: list[str] = []
        acts = ("pause", "faster", "slower", "skip", "next_finding", "again")
        self.acts = {name: lambda name=name: self.pressed.append(name) for name in acts}

    def look(self) -> Look:
        return self.seen

    def close(self) -> None:
        pass


def words(app: WatchApp, name: str) -> str:
    return str(app.query_one(f"#{name}", Static).render())


def lines(app: WatchApp, name: str) -> list[str]:
    return app.query_one(f"#{name}", Lines).texts()


async def begun(app: WatchApp, pilot) -> None:
    """The first look was taken."""
    while words(app, "state") == "looking ...":
        await pilot.pause(0.01)
    await pilot.pause()  # until it is drawn


async def show(app: WatchApp, pilot, look: Look) -> None:
    app.post_message(WatchApp.Seen(look))
    await pilot.pause()


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (40, 12)])
async def test_everything_has_its_place_and_nothing_is_wider_than_the_screen(size):
    app = WatchApp(Shown(Look(telemetry(), "live")), EVERY_S)
    async with app.run_test(size=size) as pilot:
        await begun(app, pilot)
        assert words(app, "headline").startswith("Test vehicle  0:01:00")
        assert words(app, "state") == "live"
        assert lines(app, "subjects")[1].startswith("FAULT   T3")
        assert lines(app, "links")[0].startswith("can0")
        assert "CRITICAL" in lines(app, "texts")[1]
        assert app.query_one(Footer).region.bottom == size[1]
        assert all(len(line) <= size[0] for name in ("subjects", "links", "texts") for line in lines(app, name))
        regions = [app.query_one(f"#{name}").region for name in ("headline", "state", "subjects", "links", "texts")]
        assert [one.y for one in regions[1:]] == [one.bottom for one in regions[:-1]]


async def test_at_80_by_24_links_and_newest_texts_are_in_sight_however_many_thrusters_there_are():
    app = WatchApp(Shown(Look(MANY, "live")), EVERY_S)
    async with app.run_test(size=(80, 24)) as pilot:
        await begun(app, pilot)
        assert app.query_one("#links").size.height == len(lines(app, "links")) == 4
        assert app.query_one("#texts").size.height >= 3
        subjects = app.query_one("#subjects", Lines)
        assert subjects.max_scroll_y > 0 and subjects.scroll_offset.y == 0
        await pilot.press("down", "down")
        await pilot.pause(0.3)
        assert subjects.scroll_offset.y == 2


async def test_what_changes_is_shown_and_what_is_gone_is_said():
    app = WatchApp(Shown(Look(None, "no gateway runs", fresh=False)), EVERY_S)
    async with app.run_test(size=(100, 30)) as pilot:
        await begun(app, pilot)
        assert words(app, "state") == "no gateway runs" and words(app, "headline") == ""
        await show(app, pilot, Look(telemetry(fault=False), "live"))
        assert not any("FAULT" in line for line in lines(app, "subjects"))
        await show(app, pilot, Look(telemetry(since_s=61.0), "live"))
        assert any(ENTANGLED in line for line in lines(app, "subjects"))
        assert "100 /s" in lines(app, "links")[0]
        await show(app, pilot, Look(telemetry(), "no gateway runs", "last seen 5 s ago", fresh=False))
        assert words(app, "state") == "no gateway runs  last seen 5 s ago"
        assert any(ENTANGLED in line for line in lines(app, "subjects"))


async def test_held_it_stays_as_it_is_until_it_is_let_go():
    app, found = WatchApp(Shown(Look(telemetry(fault=False), "live")), EVERY_S), Look(telemetry(), "live")
    async with app.run_test(size=(80, 24)) as pilot:
        await begun(app, pilot)
        await pilot.press("space")
        await show(app, pilot, found)
        assert words(app, "state") == "HELD  live"
        assert not any("FAULT" in line for line in lines(app, "subjects"))
        await pilot.press("space")
        await show(app, pilot, found)
        assert words(app, "state") == "live" and any("FAULT" in line for line in lines(app, "subjects"))


async def test_a_terminal_that_grows_has_more_in_a_line():
    app = WatchApp(Shown(Look(telemetry(), "live")), EVERY_S)
    async with app.run_test(size=(80, 24)) as pilot:
        await begun(app, pilot)
        small = lines(app, "subjects")
        await pilot.resize_terminal(140, 40)
        await pilot.pause()
        assert len(lines(app, "subjects")) < len(small) and lines(app, "subjects")[1].endswith(ENTANGLED)


async def test_keys_of_the_player():
    source = Shown(Look(MANY, "dive.log"))
    app = PlayerApp(source, EVERY_S)
    async with app.run_test(size=(80, 24)) as pilot:
        await begun(app, pilot)
        await pilot.press("space", "plus", "equals_sign", "minus", "right", "n", "home")
        assert source.pressed == ["pause", "faster", "faster", "slower", "skip", "next_finding", "again"]
        footer = " ".join(str(key.render()) for key in app.query("FooterKey"))
        assert all(what in footer for what in ("quit", "pause", "faster", "slower", "30 s on", "next finding"))


async def test_it_looks_again_and_again_and_q_ends_it_while_a_gateway_does_not_answer():
    busy, answer, looks = Event(), Event(), []

    class Busy(Shown):
        def look(self) -> Look:
            looks.append(self.seen)
            if len(looks) > 3:
                busy.set()
                answer.wait(20.0)
            return self.seen

    app = WatchApp(Busy(Look(telemetry(), "live")), OFTEN_S)
    async with app.run_test(size=(80, 24)) as pilot:
        while not busy.is_set():
            await pilot.pause(OFTEN_S)
        assert words(app, "state") == "live"
        await pilot.press("q")
        assert app.return_code == 0 and not answer.is_set()
    answer.set()


async def test_a_gateway_that_hangs_is_told_while_it_is_waited_for(monkeypatch):
    monkeypatch.setattr("gateway.watch.app.PATIENCE_S", 0.1)
    monkeypatch.setattr("gateway.watch.app.TICK_S", 0.05)
    answer, looks = Event(), []

    class Hanging(Shown):
        def look(self) -> Look:
            looks.append(self.seen)
            answer.wait(20.0 if len(looks) > 1 else 0.0)
            return self.seen

    app = WatchApp(Hanging(Look(telemetry(), "live")), OFTEN_S)
    async with app.run_test(size=(80, 24)) as pilot:
        while not words(app, "state").startswith("no answer for"):
            await pilot.pause(OFTEN_S)
        answer.set()
        while words(app, "state") != "live":
            await pilot.pause(OFTEN_S)


async def test_a_bug_in_a_look_is_not_swallowed():
    class Broken(Shown):
        def look(self) -> Look:
            raise LookupError("a bug")

    with pytest.raises(LookupError, match="a bug"):
        async with WatchApp(Broken(Look(None, "")), EVERY_S).run_test() as pilot:
            await pilot.pause(0.2)


async def test_only_rows_that_have_changed_are_drawn_anew():
    drawn: list[int] = []

    class Watched(Lines):
        def refresh_lines_at(self, rows) -> None:
            drawn.extend(rows)
            super().refresh_lines_at(rows)

    class Screen(App):
        def compose(self) -> ComposeResult:
            yield Watched("probe")

    async with Screen().run_test(size=(80, 24)) as pilot:
        probe = pilot.app.query_one(Watched)
        for rate, expected in ((100.0, []), (101.0, [0]), (101.0, [])):
            drawn.clear()
            probe.show(lambda width, rate=rate: link_lines(telemetry(), {"can0": rate}, Frame(width, COLOURED)))
            assert drawn == expected
        assert len(probe.texts()) == 4
