"""Key file, kept stamps, and what is said of them. Signatures themselves: drivers/mavlink/tests/test_signing.py."""

import hashlib
import json
import logging
import os
import traceback
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.signing import STAMP_END, UNSIGNED, SigningHistory, SigningKey, stamp_of
from drivers.mavlink.tests.peer import Peer
from gateway.config import parse
from gateway.config_sections import Mavlink
from gateway.problems import ConfigError
from gateway.signing.key import SIZE_MAX, KeyFileError, key_in, read_key
from gateway.signing.link import link_signing
from gateway.signing.memory import KEEP_S, HistoryError, SigningMemory, pack, unpack
from gateway.tests.conftest import TWO_THRUSTERS

NOW_S = 1_795_300_000.0
SECRET = hashlib.sha256(b"correct horse battery staple").digest()

stamps = st.integers(0, STAMP_END - 1)
histories = st.builds(
    SigningHistory,
    stamps,
    stamps,
    st.dictionaries(st.tuples(*[st.integers(0, 255)] * 3), stamps, max_size=5),
)


def same(key, secret):
    return key.proof(b"any") == SigningKey(secret).proof(b"any")


def key_file(folder, content=SECRET, mode=0o600):
    path = folder / "mavlink.key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


@pytest.mark.parametrize(
    ("content", "secret"),
    [
        (SECRET, SECRET),
        (SECRET.hex().encode(), SECRET),
        (SECRET.hex().upper().encode() + b"\r\n", SECRET),
        (b"correct horse battery staple", SECRET),
        (b"correct horse battery staple\n", SECRET),
        (b"thirty-two characters are a text", hashlib.sha256(b"thirty-two characters are a text").digest()),
        (SECRET.hex().encode()[:-2], hashlib.sha256(SECRET.hex().encode()[:-2]).digest()),
        ("Unterwasserschlüssel\n".encode(), hashlib.sha256("Unterwasserschlüssel".encode()).digest()),
        (bytes(range(32)), bytes(range(32))),
    ],
)
def test_three_forms(content, secret):
    assert same(key_in(content), secret)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"\n", "is empty"),
        (SECRET[:-1] + b"\xff\xff", "holds 33 bytes that are no text; want 64 hexadecimal digits"),
        (SECRET[:-1], "holds 31 bytes"),
        (bytes(32), "zeros means none"),
        (b"0" * 64, "zeros means none"),
        (b"one\ntwo\n", "several lines"),
        (b"a line\r\nand 32 bytes in all, so\r\n", "several lines"),
        (b" spaced", "begins or ends with a space"),
        (b"x" * (SIZE_MAX + 1), f"more than {SIZE_MAX} bytes"),
    ],
)
def test_what_is_no_key_is_refused(content, said):
    with pytest.raises(ValueError, match=said):
        key_in(content)


@given(st.binary(max_size=80))
def test_any_content_is_a_key_or_a_clear_error(content):
    try:
        assert isinstance(key_in(content), SigningKey)
    except ValueError as error:
        assert len(content) < 8 or str(content) not in str(error)


@pytest.mark.parametrize("mode", [0o600, 0o400])
def test_a_file_of_ones_own(tmp_path, mode):
    assert same(read_key(key_file(tmp_path, mode=mode)), SECRET)


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o644, 0o620, 0o700, 0o666, 0o4600])
def test_a_file_that_others_may_read_is_refused_with_the_way_out(tmp_path, mode):
    path = key_file(tmp_path, mode=mode)
    with pytest.raises(KeyFileError, match=f"has mode {mode:04o}, .*: chmod 600 {path}$"):
        read_key(path)


def test_a_file_of_somebody_else(tmp_path, monkeypatch):
    path, owner = key_file(tmp_path), os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    with pytest.raises(KeyFileError, match=f"belongs to user {owner}, .* sudo chown {owner + 1} {path}"):
        read_key(path)


def test_what_is_no_file(tmp_path):
    with pytest.raises(KeyFileError, match="No such file"):
        read_key(tmp_path / "none.key")
    with pytest.raises(KeyFileError, match="is not a file"):
        read_key(tmp_path)
    os.mkfifo(tmp_path / "pipe", 0o600)
    with pytest.raises(KeyFileError, match="is not a file"):  # and does not wait for a writer
        read_key(tmp_path / "pipe")


@given(histories)
def test_stamps_come_back_from_the_file(history):
    assert unpack(pack(history)) == history


@pytest.mark.parametrize(
    "change",
    [
        {"format": "stamps 0"},
        {"clock": -1},
        {"clock": 1.5},
        {"clock": True},
        {"reserved": "soon"},
        {"reserved": STAMP_END},
        {"streams": [[1, 1, 5]]},
        {"streams": [[1, 1, 256, 5]]},
        {"streams": [[1, 1, 0.5, 5]]},
        {"streams": 5},
    ],
)
def test_a_damaged_file_of_stamps(change):
    with pytest.raises(HistoryError):
        unpack(json.dumps(json.loads(pack(SigningHistory(5, 6, {(1, 1, 0): 7}))) | change).encode())


@given(st.binary(max_size=60))
def test_any_other_file_is_no_file_of_stamps(data):
    with pytest.raises(HistoryError):
        unpack(data)


@pytest.mark.parametrize(
    "content", [b"", b"garbage", b"\xff" * 50, b"[" * 5000, pack(SigningHistory(clock=STAMP_END - 1))]
)
def test_stamps_that_cannot_be_believed_are_begun_anew_and_said(tmp_path, caplog, content):
    path = tmp_path / "vehicle.state.stamps"
    path.write_bytes(content)
    assert SigningMemory(path).recall(NOW_S) == SigningHistory()
    assert "set up its key anew" in caplog.text


def test_stamps_that_cannot_be_kept_are_told_once(tmp_path, caplog):
    memory = SigningMemory(tmp_path / "none" / "vehicle.state.stamps")
    for _ in range(3):
        memory.keep(SigningHistory())
    memory.close(SigningHistory())
    assert caplog.text.count("cannot be kept") == 1


def mavlink(path, **keys):
    return Mavlink(endpoint="udpin:127.0.0.1:0", signing_key=path, **keys)


def stamp_in(packet):
    return int.from_bytes(packet[-12:-6], "little")


@pytest.mark.parametrize("clean", [True, False])
@pytest.mark.parametrize("woken_s", [0.0, NOW_S - 86_400.0, NOW_S + 50.0])
def test_a_run_goes_on_above_the_one_before(tmp_path, clean, woken_s):
    settings, state = mavlink(key_file(tmp_path), signing_link_id=3), tmp_path / "vehicle.state"
    first = link_signing(settings, state, NOW_S)
    sent = []
    for second in range(45):
        first.advance(NOW_S + second)
        sent.append(stamp_in(first.signing.sign(Peer().heartbeat(), NOW_S + second)))
    if clean:
        first.close(NOW_S + 45.0)
    else:
        first._memory._thread.shutdown()  # what was written until then is there, and nothing else
    second = link_signing(settings, state, woken_s)
    packet = second.signing.sign(Peer().heartbeat(), woken_s)
    assert stamp_in(packet) > max(sent) and packet[-13] == 3
    assert second.signing.clock(woken_s) >= stamp_of(NOW_S)
    second.close(woken_s)


def test_stamps_are_kept_at_the_start_twice_a_minute_and_at_the_end(tmp_path):
    state = tmp_path / "vehicle.state"
    kept = link_signing(mavlink(key_file(tmp_path)), state, NOW_S)
    written = []
    for second in range(121):
        kept.advance(NOW_S + second)
        kept._memory._thread.submit(lambda: None).result()  # all before it is written
        written.append(unpack((tmp_path / "vehicle.state.stamps").read_bytes()))
    assert len({one.clock for one in written}) == 1 + 120 // KEEP_S
    kept.close(NOW_S + 121.0)
    assert unpack((tmp_path / "vehicle.state.stamps").read_bytes()).clock == stamp_of(NOW_S + 121.0)


def test_no_key_no_signing(tmp_path):
    assert link_signing(mavlink(None), tmp_path / "vehicle.state", NOW_S) is None


def test_each_kind_of_refusal_is_said_once_with_the_way_out(tmp_path):
    kept = link_signing(mavlink(key_file(tmp_path)), tmp_path / "vehicle.state", NOW_S)
    drops = Counter({"checksum": 5})
    assert list(kept.news(drops)) == []
    drops[UNSIGNED] += 3
    (said,) = kept.news(drops)
    assert "mavlink.accept_unsigned" in said
    drops["wrong key"] += 1
    (said,) = kept.news(drops)
    assert "another key" in said
    assert list(kept.news(drops)) == []
    kept.close(NOW_S)


def config_text(extra):
    return TWO_THRUSTERS.replace("[mavlink]\n", f"[mavlink]\n{extra}\n")


def test_key_is_found_beside_the_configuration(tmp_path):
    config = parse(config_text('signing_key = "mavlink.key"'), tmp_path)
    assert config.mavlink.signing_key == tmp_path / "mavlink.key"
    assert config.mavlink.operators == [255]


@pytest.mark.parametrize("key", ["accept_unsigned = true", "signing_link_id = 2"])
def test_keys_that_mean_nothing_without_a_signing_key(tmp_path, key):
    with pytest.raises(ConfigError, match=rf"mavlink\.{key.split()[0]} = .* means nothing without"):
        parse(config_text(key), tmp_path)


def test_no_error_and_no_log_shows_the_key(tmp_path, caplog):
    caplog.set_level(logging.DEBUG)
    passphrase = "never " + "to be seen"
    said = []
    for content, mode in (
        (passphrase.encode(), 0o644),
        (f" {passphrase}".encode(), 0o600),
        (f"{passphrase}\n{passphrase}".encode(), 0o600),
        (passphrase.encode() + b"\xff", 0o600),
        ((passphrase * 100).encode(), 0o600),
    ):
        key_file(tmp_path, content, mode)
        with pytest.raises(ConfigError) as caught:
            link_signing(mavlink(tmp_path / "mavlink.key"), tmp_path / "vehicle.state", NOW_S)
        said += traceback.format_exception(caught.value)
        logging.getLogger("gateway").error("refused", exc_info=caught.value)
    key_file(tmp_path, passphrase.encode())
    kept = link_signing(mavlink(tmp_path / "mavlink.key"), tmp_path / "vehicle.state", NOW_S)
    said += [repr(kept), repr(vars(kept)), repr(vars(kept.signing)), repr(mavlink(tmp_path / "mavlink.key"))]
    kept.close(NOW_S)
    said += [(tmp_path / "vehicle.state.stamps").read_text(), caplog.text]
    assert caplog.records
    for secret in (passphrase, hashlib.sha256(passphrase.encode()).hexdigest(), passphrase.encode().hex()):
        assert not any(secret in text for text in said)
