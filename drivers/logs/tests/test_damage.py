"""What was lost, in words."""

from __future__ import annotations

from drivers.logs.damage import DamageReport


def test_each_cause_is_counted_with_its_first_places():
    damage = DamageReport()
    for line in range(1, 8):
        damage.add("no '#'", f"line {line}")
    damage.add("cut off", "offset 4711", count=100)
    assert damage.lines() == [
        "cut off: 100 (offset 4711, ...)",
        "no '#': 7 (line 1, line 2, line 3, line 4, line 5, ...)",
    ]


def test_where_nothing_was_lost_nothing_is_said():
    assert DamageReport().lines() == []
