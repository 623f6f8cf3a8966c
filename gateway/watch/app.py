"""The watch on a whole terminal: looks, draws, and takes keys."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import ClassVar

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.widgets import Footer, Static

from gateway.watch.lines import Lines
from gateway.watch.looking import Looking
from gateway.watch.palette import COLOURED, PLAIN
from gateway.watch.rates import Rates
from gateway.watch.source import Look, Played, Source
from gateway.watch.view import Frame, headline, link_lines, subject_lines, text_lines
from gateway.watch.words import ago, printable

# the terminal's own colours and ground, light or dark
OWN_COLOURS = "ansi-dark"


# a look that takes so much longer than the time between two is told
PATIENCE_S, TICK_S = 2.0, 1.0


class WatchApp(App[None]):
    """See the module's text.

    Args:
        source: what is looked at.
        every_s: time from one look to the next.
    """

    class Seen(Message):
        """From the thread that looks."""

        def __init__(self, look: Look | Exception) -> None:
            super().__init__()
            self.look = look

    CSS = """
    #headline { height: 1; text-style: bold; }
    #state { height: auto; max-height: 2; }
    Lines { scrollbar-size-vertical: 1; }
    #subjects { height: 1fr; }
    #links { height: auto; max-height: 6; }
    #texts { height: 18%; min-height: 3; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("q,escape,ctrl+c", "quit", "quit", key_display="q", priority=True),
        Binding("space", "hold", "hold"),
    ]
    ENABLE_COMMAND_PALETTE = False

    def __init__(self, source: Source, every_s: float) -> None:
        super().__init__(ansi_color=True)
        if OWN_COLOURS in self.available_themes:
            self.theme = OWN_COLOURS
        self._looking = Looking(source, every_s, lambda look: self.post_message(self.Seen(look)))
        self._rates = Rates()
        self._look: Look | None = None
        self._seen_s, self._patience_s = time.monotonic(), 2.0 * every_s + PATIENCE_S
        self._rate: Mapping[str, float] = {}
        self._held = False

    def compose(self) -> ComposeResult:
        """Headline and state, what is watched, keys."""
        yield Static(id="headline", markup=False)
        yield Static("looking ...", id="state", markup=False)
        yield Lines("subjects")
        yield Lines("links")
        yield Lines("texts")
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Begins to look."""
        self.query_one("#subjects", Lines).focus()
        self._looking.start()
        self.set_interval(TICK_S, self._wonder)

    def on_unmount(self) -> None:
        """Looks no more."""
        self._looking.stop()

    def action_hold(self) -> None:
        """What is shown stays as it is, until it is wanted to go on."""
        self._held = not self._held
        self._draw()

    def on_watch_app_seen(self, message: Seen) -> None:
        """A look, or what is a bug."""
        if isinstance(message.look, Exception):
            raise message.look
        self._seen_s = time.monotonic()
        if not self._held:
            self.take(message.look)

    def take(self, look: Look) -> None:
        """Shows what was seen."""
        self._look = look
        if look.telemetry is not None and look.fresh:
            self._rate = self._rates.take(look.telemetry)
        self._draw()

    def _wonder(self) -> None:
        """A look that takes long: what is shown is old, then."""
        silent_s = time.monotonic() - self._seen_s
        if silent_s > self._patience_s:
            self._tell("state", f"no answer for {ago(silent_s)}", "reverse")

    def _draw(self) -> None:
        look = self._look
        if look is None:
            return
        telemetry = look.telemetry
        self._tell("headline", "" if telemetry is None else headline(telemetry))
        words = "  ".join(filter(None, ("HELD" if self._held else "", look.state, look.note)))
        self._tell("state", words, "" if look.fresh else "reverse")
        if telemetry is not None:
            self._show("subjects", partial(subject_lines, telemetry), look.fresh)
            self._show("links", partial(link_lines, telemetry, self._rate if look.fresh else {}), look.fresh)
            self._show("texts", partial(text_lines, telemetry), look.fresh)

    def _tell(self, name: str, words: str, style: str = "") -> None:
        self.query_one(f"#{name}", Static).update(Text(printable(words), style=style))

    def _show(self, name: str, drawn: Callable[[Frame], list[Text]], fresh: bool) -> None:
        """What is no more so is dimmed."""
        palette = PLAIN if self.no_color else COLOURED

        def lines(width: int) -> list[Text]:
            several = drawn(Frame(width, palette))
            return several if fresh else [Text().append(line.plain, style=palette.faint) for line in several]

        self.query_one(f"#{name}", Lines).show(lines)


class PlayerApp(WatchApp):
    """The watch of a recorded dive, with the keys of a player."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "act('pause')", "pause"),
        Binding("plus,equals_sign", "act('faster')", "faster", key_display="+"),
        Binding("minus", "act('slower')", "slower", key_display="-"),
        Binding("right", "act('skip')", "30 s on", priority=True),  # elsewhere they scroll
        Binding("n", "act('next_finding')", "next finding"),
        Binding("home", "act('again')", "again", priority=True),
    ]

    def __init__(self, source: Played, every_s: float) -> None:
        super().__init__(source, every_s)
        self._acts = source.acts

    def action_act(self, act: str) -> None:
        """Does what a key asks for."""
        self._acts[act]()
