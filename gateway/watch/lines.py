"""Lines on a screen of which only those are sent to the terminal that have changed: over a slow link, that counts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rich.text import Text
from textual.geometry import Region, Size
from textual.scroll_view import ScrollView
from textual.strip import Strip

# lines for so many cells
Drawn = Callable[[int], list[Text]]


class Lines(ScrollView, can_focus=True):
    """Text that scrolls."""

    def __init__(self, name: str) -> None:
        super().__init__(id=name)
        self._drawn: Drawn = lambda _: []
        self._lines: list[Text] = []

    def show(self, drawn: Drawn) -> None:
        """Shows these lines in place of those before; whenever the width is another, they are made anew."""
        self._drawn = drawn
        self._redraw()

    def on_resize(self) -> None:
        """The same in another width."""
        self._redraw()

    def _redraw(self) -> None:
        width = self.scrollable_content_region.width
        if width:  # it has none before it has its place on the screen
            self._take(self._drawn(width))

    def _take(self, lines: list[Text]) -> None:
        old, self._lines = self._lines, lines
        if len(old) != len(lines):
            self.virtual_size = Size(0, len(lines))
            self.refresh(layout=self.styles.auto_dimensions)
            return
        top = self.scroll_offset.y
        changed = [row - top for row, (a, b) in enumerate(zip(old, lines, strict=True)) if not _same(a, b)]
        self.refresh_lines_at(changed)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """Where the height is that of what is shown."""
        return len(self._lines)

    def refresh_lines_at(self, rows: Sequence[int]) -> None:
        """Draws rows of the screen anew, as far as they are on it."""
        width, height = self.size
        regions = [Region(0, row, width, 1) for row in rows if 0 <= row < height]
        if regions:
            self.refresh(*regions)

    def render_line(self, y: int) -> Strip:
        """One of them, as the screen wants it."""
        row, width = y + self.scroll_offset.y, self.size.width
        if row >= len(self._lines):
            return Strip.blank(width, self.rich_style)
        text = self._lines[row]
        return Strip(text.render(self.app.console), text.cell_len).crop_extend(0, width, self.rich_style)

    def texts(self) -> list[str]:
        """What is shown, without its styles."""
        return [line.plain for line in self._lines]


def _same(a: Text, b: Text) -> bool:
    return a.plain == b.plain and a.spans == b.spans and a.style == b.style
