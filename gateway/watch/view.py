"""A telemetry as lines for a terminal of some width. Nothing is told by colour alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite

from rich.cells import cell_len
from rich.text import Text

from detectors.verdict import Level
from gateway.telemetry import LinkTelemetry, Said, Telemetry
from gateway.watch.bar import FULL, bar
from gateway.watch.palette import Palette
from gateway.watch.rows import SubjectRow, Subjects, subjects
from gateway.watch.words import UNKNOWN, ago, clock, counted, number, printable, severity_word

LEVEL_CELLS, SCORE_CELLS, NAME_CELLS_MAX = 7, 5, 16
# cells of a bar, by the least width of the terminal that has room for it
BARS: Mapping[int, int] = {110: 21, 76: 13, 60: 9}
SPACE, GAP = " ", "  "
# of a subject's second line
INDENT = LEVEL_CELLS + 1


@dataclass(frozen=True, slots=True)
class Frame:
    """What a picture is drawn for. `width`: of the terminal, in cells."""

    width: int
    palette: Palette

    @property
    def bar_cells(self) -> int:
        """Of each bar; 0: there is no room for one."""
        return next((cells for least, cells in BARS.items() if self.width >= least), 0)


def headline(telemetry: Telemetry) -> str:
    """Who it is, for how long, and how well the judging keeps up."""
    found = counted({level: n for level, n in telemetry.findings.items() if level in ("FAULT", "SUSPECT")})
    parts = (
        telemetry.vehicle,
        clock(telemetry.running_s),
        f"judging {telemetry.behind_s:.1f} s behind" if telemetry.behind_s > 0.0 else "",
        f"found: {found or 'nothing'}",
    )
    return printable("  ".join(filter(None, parts)))


def subject_lines(telemetry: Telemetry, frame: Frame) -> list[Text]:
    """The subjects, worst first, line by line."""
    return _cut(list(_subject_lines(subjects(telemetry.subjects), frame)), frame)


def link_lines(telemetry: Telemetry, rates: Mapping[str, float], frame: Frame) -> list[Text]:
    """Links, what was dropped elsewhere, and the recording; `rates`: by link, of what it receives in a second."""
    return _cut(list(_link_lines(telemetry, rates, frame)), frame)


def text_lines(telemetry: Telemetry, frame: Frame) -> list[Text]:
    """What the pilot was told, newest first, line by line."""
    told = [_text(said, frame) for said in reversed(telemetry.texts)]
    return _cut([_heading("texts to the pilot", frame), *(told or [_styled("none", frame.palette.faint)])], frame)


def _cut(lines: list[Text], frame: Frame) -> list[Text]:
    for line in lines:
        line.plain = printable(line.plain)
        line.truncate(frame.width, overflow="ellipsis")
    return lines


def _styled(words: str, style: str) -> Text:
    """Styled by a span: of a text without spans, screens show no style at all."""
    return Text().append(words, style=style)


def _heading(words: str, frame: Frame) -> Text:
    return _styled(words, frame.palette.heading)


def _subject_lines(shown: Subjects, frame: Frame) -> Iterator[Text]:
    names = max((len(row.name) for row in shown.rows), default=0)
    name_cells = min(max(names, len("subject")), NAME_CELLS_MAX)
    yield _heading(f"{'level':{LEVEL_CELLS}} {'subject':{name_cells}} {_scale(frame.bar_cells)}score", frame)
    for row in shown.rows:
        yield from _subject(row, name_cells, frame)
    for level, others in shown.others.items():
        line = _styled(f"{level.name:{LEVEL_CELLS}} ", frame.palette.levels[level])
        yield line.append(others, style=frame.palette.faint)
    if not (shown.rows or shown.others):
        yield _styled("nothing was heard yet", frame.palette.faint)


def _scale(cells: int) -> str:
    """What the marks of the bars mean: the threshold to both sides."""
    if not cells:
        return ""
    marks = [SPACE] * cells
    for place, words in ((-1, "-1"), (0, "0"), (1, "+1")):
        column = cells // 2 + place * round(cells // 2 / FULL)
        begin = column - (len(words) == 2 and place < 0)
        marks[begin : begin + len(words)] = words
    return "".join(marks) + SPACE


def _subject(row: SubjectRow, name_cells: int, frame: Frame) -> Iterator[Text]:
    """Its line; where something is wrong, more for what there is no room for."""
    line = _styled(f"{row.level.name:{LEVEL_CELLS}}", frame.palette.levels[row.level])
    line.append(f" {row.name:{name_cells}} ")
    if frame.bar_cells:
        line.append(bar(row.share, frame.bar_cells) + SPACE, style=frame.palette.bars[row.level])
    line.append(f"{number(row.score, '.2f'):>{SCORE_CELLS}}")
    wrong = row.level in (Level.FAULT, Level.SUSPECT)
    parts = (*row.values, row.text) if wrong else (row.text, *row.values)
    for words in filter(None, parts):
        if line.cell_len + len(GAP) + cell_len(words) <= frame.width or line.cell_len <= INDENT:
            line.append(GAP + words)
        elif wrong:
            yield line
            line = Text(SPACE * (INDENT - len(GAP)) + GAP + words)
    yield line


def _link_lines(telemetry: Telemetry, rates: Mapping[str, float], frame: Frame) -> Iterator[Text]:
    names = max((len(link.name) for link in telemetry.links), default=0)
    for link in telemetry.links:
        yield _link(link, rates, names, frame)
    for stage, drops in telemetry.drops.items():
        if dropped := counted(drops):
            yield _styled(f"dropped at {stage}: {dropped}", frame.palette.faint)
    if telemetry.recording:
        yield Text(telemetry.recording)


def state_word(up: bool | None) -> str:
    """Of a link: "up", "DOWN", or "-" where nobody has said."""
    return UNKNOWN if up is None else "up" if up else "DOWN"


def _link(link: LinkTelemetry, rates: Mapping[str, float], name_cells: int, frame: Frame) -> Text:
    line = Text(f"{link.name:{name_cells}}  ")
    line.append(f"{state_word(link.up):4}", style="bold" if link.up is False else "")
    line.append(f"  {number(rates[link.name]) if link.name in rates else '-':>6} /s")
    if isfinite(link.load):
        line.append(f"  load {100.0 * link.load:3.0f} %")
    for words in (f"dropped: {dropped}" if (dropped := counted(link.drops)) else "", link.detail):
        line.append(f"  {words}" if words else "")
    return line


def _text(said: Said, frame: Frame) -> Text:
    line = _styled(f"{ago(said.age_s):>6} ago  ", frame.palette.faint)
    words = f"{severity_word(said.severity)}: {said.text}"
    return line.append(words, style=frame.palette.severities.get(said.severity, ""))
