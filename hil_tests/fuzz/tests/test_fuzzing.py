"""Fuzzing itself: it finds what is there to be found, says how it comes again, and is the same in every run."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from itertools import islice
from random import Random

import pytest
from click.testing import CliRunner

from hil_tests.fuzz import command
from hil_tests.fuzz.command import fuzz
from hil_tests.fuzz.damaging import damaged_inputs, first_failure
from hil_tests.fuzz.mutations import INPUT_MAX, KINDS, Damage, random_damage
from hil_tests.fuzz.session import Session, is_guided, reproduce
from hil_tests.fuzz.target import MIB, Target

SEED = b"length=4;data=abcd"


def target(check, **options):
    return Target("trial", "a parser of the tests", check, lambda: [SEED], **options)


def fails_on_zero(data):
    if b"\0" in data:
        raise ValueError("a zero")


def takes_memory(data):
    if data != SEED:
        bytearray(4 * MIB)


def warns(data):
    if len(data) < len(SEED):
        warnings.warn("short", RuntimeWarning, stacklevel=1)


def some_inputs(number=300):
    return islice(damaged_inputs(target(bytes)), number)


@pytest.mark.parametrize(
    ("check", "options", "error"),
    [
        (fails_on_zero, {}, ValueError),
        (takes_memory, {"memory_max": MIB}, AssertionError),
        (warns, {}, RuntimeWarning),
    ],
)
def test_what_a_parser_must_not_do_is_found(check, options, error):
    failure = first_failure(target(check, **options), some_inputs())
    assert failure is not None
    assert isinstance(failure.error, error)


def test_a_parser_that_stands_all_has_no_failure():
    assert first_failure(target(bytes), some_inputs()) is None
    assert first_failure(target(takes_memory, memory_max=8 * MIB), some_inputs()) is None


def test_inputs_are_the_same_in_every_run_and_others_with_another_seed():
    first, again = list(some_inputs()), list(some_inputs())
    assert first == again
    assert first[0] == SEED
    assert list(islice(damaged_inputs(target(bytes), seed=1), 300)) != first
    assert len(set(first)) > 150


def test_damage_of_every_kind_is_of_some_size_and_ends():
    for kind in range(len(KINDS)):
        for place in (0, 5, len(SEED), 4 * INPUT_MAX):
            damage = Damage(kind, place, place + 3, 4, b"xyz")
            assert len(damage.done_to(SEED)) <= 2 * len(SEED)
            assert len(damage.done_to(b"")) <= 3
            assert len(damage.done_to(bytes(INPUT_MAX))) <= INPUT_MAX


def test_tokens_come_in():
    chance = Random(1)
    damaged = [random_damage(chance, (b"TOKEN",), (SEED,)).done_to(SEED) for _ in range(300)]
    assert any(b"TOKEN" in one for one in damaged)


@pytest.mark.parametrize("name", ["", "two words", "Capital"])
def test_names_are_words_of_the_command_line(name):
    with pytest.raises(ValueError, match="name must be a word"):
        Target(name, "", bytes, list)


def test_what_failed_is_kept_and_comes_again(tmp_path, capsys):
    trial = Session(target(fails_on_zero), 20.0, tmp_path / "trial")
    (path,) = trial.unguided()
    assert "a zero" in capsys.readouterr().err
    assert isinstance(reproduce(trial.target, path), ValueError)
    path.write_bytes(SEED)
    assert reproduce(trial.target, path) is None


def test_the_command_says_how(tmp_path, monkeypatch):
    monkeypatch.setitem(command.TARGETS, "request", target(fails_on_zero))
    monkeypatch.setattr(command, "is_guided", lambda: False)
    result = CliRunner().invoke(fuzz, ["--target", "request", "--seconds", "20", "--out", str(tmp_path)])
    assert result.exit_code == 1
    assert "atheris is not installed" in result.output
    again = result.output.partition("once more: python -m hil_tests.fuzz ")[2].split()
    assert again[:2] == ["--target", "trial"]
    kept = again[3]
    assert CliRunner().invoke(fuzz, ["--target", "request", "--input", kept]).exit_code == 1
    (tmp_path / "well").write_bytes(SEED)
    assert CliRunner().invoke(fuzz, ["--target", "request", "--input", str(tmp_path / "well")]).exit_code == 0


@pytest.mark.parametrize(
    "arguments",
    [["--input", "anything"], ["--target", "nothing"], ["--target", "tlog", "--input", "/nowhere/at/all"]],
)
def test_what_cannot_be_done_is_refused(arguments):
    result = CliRunner().invoke(fuzz, arguments)
    assert result.exit_code in (1, 2)
    assert "Error: " in result.output


def test_the_list_has_all():
    listed = subprocess.run(
        [sys.executable, "-m", "hil_tests.fuzz", "--list"], capture_output=True, text=True, check=True, timeout=60
    )
    assert [line.split()[0] for line in listed.stdout.splitlines()] == list(command.TARGETS)


@pytest.mark.skipif(not is_guided(), reason="atheris is not installed: pip install 'thruster-gateway[fuzz]'")
def test_with_atheris_inputs_that_reach_something_new_are_kept(tmp_path):
    trial = Session(command.TARGETS["request"], 2.0, tmp_path / "request")
    assert trial.guided() == []
    assert len(list((trial.folder / "corpus").iterdir())) > len(trial.target.seeds())


def test_an_end_without_a_reason_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(Session, "_run", lambda *_: 1)
    with pytest.raises(RuntimeError, match="trial: atheris ended with 1"):
        Session(target(bytes), 1.0, tmp_path).guided()


def test_what_fails_again_is_told_again(tmp_path, monkeypatch):
    kept, times_ns = tmp_path / "failed-crash-1", iter((1_000_000_000, 2_000_000_000))

    def ended(*_):
        kept.write_bytes(SEED)
        time_ns = next(times_ns)
        os.utime(kept, ns=(time_ns, time_ns))
        return 77

    monkeypatch.setattr(Session, "_run", ended)
    trial = Session(target(bytes), 1.0, tmp_path)
    assert trial.guided() == [kept]
    assert trial.guided() == [kept]
