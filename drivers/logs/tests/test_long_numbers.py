"""Numbers of thousands of digits, which Python makes no integers of: each costs its line."""

from __future__ import annotations

import pytest

from drivers.logs.can_log import open_can_log
from drivers.logs.damage import DamageReport

LONG = "9" * 5000
ASC = "date Sun Sep 13 12:26:40.000 2020\nbase {base}  timestamps absolute\n{line}\n 0.002 1 1 Rx d 1 11\n"
TRC = ";$FILEVERSION=1.1\n{line}\n 2) 2.0 Rx 0123 1 11\n"
TYPED_TRC = ";$FILEVERSION=2.0\n;$COLUMNS=N,O,T,I,d,l,D\n{line}\n2 2.0 DT 123 Rx 1 11\n"


@pytest.mark.parametrize(
    "text",
    [
        ASC.format(base="hex", line=f" 0.001 CANFD 1 Rx 123 1 0 8 {LONG} 11"),
        ASC.format(base="dec", line=f" 0.001 1 {LONG} Rx d 1 11"),
        ASC.format(base="dec", line=f" 0.001 1 1 Rx d {LONG} 11"),
        TRC.format(line=f" 1) 1.0 Rx 0123 {LONG} 11"),
        TYPED_TRC.format(line=f"1 1.0 DT 123 Rx {LONG} 11"),
    ],
    ids=["length of CAN FD", "identifier", "length code", "length in a trace", "typed length in a trace"],
)
def test_the_next_line_is_read(tmp_path, text):
    path = tmp_path / "log"
    path.write_text(text)
    damage = DamageReport()
    frames = [frame for _, block in open_can_log(path, damage) for frame in block.frames()]
    assert [len(frame.data) for frame in frames] == [1]
    assert damage.lost == {"number too long": 1}
