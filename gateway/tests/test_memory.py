"""What a run leaves to the next: what does not age is always taken, the rest only while it is young."""

import errno
import logging
import os
import time
from pathlib import Path

import pytest

from gateway import state
from gateway.channel import Learnt
from gateway.memory import Memory
from gateway.moment import Moment

YOUNG_S = 600.0


class Known:
    """What a pipeline knows, as far as a memory sees it."""

    def __init__(self, passing: object = None, foreign: list[str] | None = None) -> None:
        self.passing, self.foreign = passing, foreign or []
        self.recalled: list[str] = []
        self.resumed: list[object] = []

    def learnt(self) -> dict[str, Learnt]:
        return {"thruster 1": Learnt("sources", "settings", 50.0, None)}

    def recall(self, learnt) -> list[str]:
        self.recalled += learnt
        return self.foreign

    def remember(self) -> object:
        return self.passing

    def resume(self, memory: object) -> None:
        self.resumed.append(memory)


class Watch:
    """The time that a test says."""

    now = Moment("this boot", 5000.0, 1.7e9)
    set_by_s = 0.0

    def __call__(self) -> Moment:
        return self.now

    def clock(self) -> float:
        return self.now.unix_s + self.set_by_s

    def pass_s(self, seconds: float, boot: str = "this boot") -> None:
        since_boot_s = self.now.since_boot_s + seconds if boot == self.now.boot else 20.0
        self.now = Moment(boot, since_boot_s, self.now.unix_s + seconds)


@pytest.fixture
def watch() -> Watch:
    return Watch()


@pytest.fixture
def memory(tmp_path, watch, caplog) -> Memory:
    caplog.set_level(logging.INFO, "gateway")
    memory = Memory(tmp_path / "vehicle.state", YOUNG_S, watch.clock, watch)
    memory.store(Known({"thruster 1": "FAULT"}))
    return memory


def taken(memory: Memory) -> Known:
    new = Known()
    memory.recall(new)
    return new


@pytest.mark.parametrize(("age_s", "said"), [(0.0, "0 s"), (34.0, "34 s"), (YOUNG_S, "10 min")])
def test_a_young_state_is_taken_whole(memory, watch, caplog, age_s, said):
    watch.pass_s(age_s)
    new = taken(memory)
    assert new.recalled == ["thruster 1"]
    assert new.resumed == [{"thruster 1": "FAULT"}]
    assert caplog.messages == [f"state is {said} old: levels go on as they were"]


@pytest.mark.parametrize(("age_s", "said"), [(601.0, "10 min"), (12_600.0, "3.5 h"), (2.6e6, "30 d")])
def test_of_an_older_state_only_what_was_learnt_is_taken(memory, watch, caplog, age_s, said):
    watch.pass_s(age_s)
    new = taken(memory)
    assert (new.recalled, new.resumed) == (["thruster 1"], [])
    assert caplog.messages == [f"state is {said} old: levels start anew, what was learnt holds"]


@pytest.mark.parametrize("seconds", [-7200.0, 30.0])
def test_after_a_boot_no_age_is_known_whatever_the_wall_clock_says(memory, watch, caplog, seconds):
    watch.pass_s(seconds, boot="next boot")
    new = taken(memory)
    assert (new.recalled, new.resumed) == (["thruster 1"], [])
    (message,) = caplog.messages
    assert message.startswith("state is of an earlier boot (2023-11-1") and "what was learnt holds" in message


@pytest.mark.parametrize("seconds", [-86_400.0, 60.0, 5.4e8])
def test_times_of_a_clock_that_was_set_since_mean_nothing(memory, watch, caplog, seconds):
    watch.pass_s(34.0)
    watch.set_by_s = seconds
    new = taken(memory)
    assert (new.recalled, new.resumed) == (["thruster 1"], [])
    assert caplog.messages == [
        f"state is 34 s old, and the clock was set by {seconds:+.0f} s since: "
        "levels start anew, what was learnt holds"
    ]


def test_a_foreign_subject_is_kept_aside_and_the_rest_taken(memory, tmp_path, caplog):
    new = Known(foreign=["thruster 9"])
    memory.recall(new)
    assert new.resumed
    assert (tmp_path / "vehicle.state.aside").read_bytes() == (tmp_path / "vehicle.state").read_bytes()
    assert any("is of others: thruster 9: kept as vehicle.state.aside" in line for line in caplog.messages)


def test_the_first_run_has_nothing_to_take(tmp_path, caplog):
    new = Known()
    Memory(tmp_path / "none", YOUNG_S, time.time).recall(new)
    assert (new.recalled, new.resumed, caplog.messages) == ([], [], [])


def test_a_crash_in_the_middle_of_writing_leaves_the_old_state(memory, tmp_path, watch, monkeypatch):
    before = (tmp_path / "vehicle.state").read_bytes()

    def power_fails(_descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", power_fails)
    watch.pass_s(60.0)
    with pytest.raises(KeyboardInterrupt):
        memory.store(Known("newer"))
    monkeypatch.undo()
    assert (tmp_path / "vehicle.state").read_bytes() == before
    assert taken(memory).resumed == [{"thruster 1": "FAULT"}]
    memory.store(Known("newer"))  # over what the crash has left half written
    assert taken(memory).resumed == ["newer"]


def test_a_full_disk_is_told_once_until_there_is_room_again(memory, tmp_path, monkeypatch, caplog):
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    for _ in range(3):
        memory.store(Known("newer"))
    monkeypatch.undo()
    assert [record.levelname for record in caplog.records] == ["ERROR"] and "No space left" in caplog.text
    assert taken(memory).resumed[0] == {"thruster 1": "FAULT"}
    memory.store(Known("newer"))
    assert taken(memory).resumed == ["newer"]


@pytest.mark.parametrize("content", [b"garbage", b"", b'{"format": "thruster-gateway state 2"}\n', b"\x00" * 4096])
def test_a_foreign_file_is_set_aside(tmp_path, content, caplog):
    path = tmp_path / "vehicle.state"
    path.write_bytes(content)
    new = Known()
    Memory(path, YOUNG_S, time.time).recall(new)
    assert (new.recalled, new.resumed) == ([], [])
    assert (tmp_path / "vehicle.state.aside").read_bytes() == content and not path.exists()
    assert "kept as vehicle.state.aside" in caplog.text


def test_a_file_that_cannot_be_read_is_told(tmp_path, caplog):
    Memory(tmp_path, YOUNG_S, time.time).recall(Known())
    assert "cannot be read, all is learnt anew" in caplog.text


def test_the_state_file_is_for_its_owner_to_find_where_it_was_named(memory, tmp_path):
    assert [path.name for path in Path(tmp_path).iterdir()] == ["vehicle.state"]
    assert state.load(tmp_path / "vehicle.state").saved == Watch.now
