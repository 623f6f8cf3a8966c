"""The file with the key of MAVLink 2 signing. What is in it is never shown: errors say what is wrong with it, only.

It has one of three forms, told apart by what it holds:

- 64 hexadecimal digits: the 32 bytes of the key.
- Another line of text: a passphrase, of which the key is the SHA-256, as MAVProxy, Mission Planner and QGroundControl
  make it.
- 32 bytes that are no line of text: the key itself.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from drivers.mavlink.signing import KEY_SIZE, SigningKey

FORMS = "64 hexadecimal digits, a passphrase in one line, or 32 bytes"
# Far more than any form needs: whoever names a log here is told so before all of it is read.
SIZE_MAX = 1024
OWNER_ONLY = stat.S_IRUSR | stat.S_IWUSR


class KeyFileError(ValueError):
    """A key file that cannot be used. Its text says why, and what to do."""


def read_key(path: Path) -> SigningKey:
    """The key in a file that is this user's alone.

    Raises:
        KeyFileError: it is missing, others may read it, or it holds no key.
    """
    try:
        content = _content(path)
    except OSError as error:
        raise KeyFileError(f"cannot be read: {error.strerror or error}; want a file with {FORMS}") from error
    try:
        return key_in(content)
    except ValueError as error:
        raise KeyFileError(str(error)) from None  # a chain of causes would lead to the content


def _content(path: Path) -> bytes:
    # a pipe must not keep us waiting; and it is the open file that is checked, not what lies there a moment later
    file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        _check_guarded(path, os.fstat(file))
        return os.read(file, SIZE_MAX + 1)
    finally:
        os.close(file)


def _check_guarded(path: Path, status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        raise KeyFileError(f"is not a file; want a file with {FORMS}")
    if status.st_uid != os.geteuid():
        raise KeyFileError(
            f"belongs to user {status.st_uid}, and this is user {os.geteuid()}: sudo chown {os.geteuid()} {path}"
        )
    mode = stat.S_IMODE(status.st_mode)
    if mode & ~OWNER_ONLY:
        raise KeyFileError(f"has mode {mode:04o}, and a key is its owner's alone: chmod 600 {path}")


def key_in(content: bytes) -> SigningKey:
    """The key in the content of a key file.

    Raises:
        ValueError: none of the three forms; it shows nothing of the content.
    """
    if len(content) > SIZE_MAX:
        raise ValueError(f"holds more than {SIZE_MAX} bytes; want {FORMS}")
    text = _text(content)
    if text is not None:
        return _key_of_line(text.removesuffix("\n").removesuffix("\r"))
    if len(content) != KEY_SIZE:
        raise ValueError(f"holds {len(content)} bytes that are no text; want {FORMS}")
    return SigningKey(content)


def _text(content: bytes) -> str | None:
    """The content as text; None if it is none. That random bytes look like text does not happen."""
    try:
        text = content.decode()
    except UnicodeDecodeError:
        return None
    return text if all(character.isprintable() or character in "\t\r\n" for character in text) else None


def _key_of_line(line: str) -> SigningKey:
    if not line:
        raise ValueError(f"is empty; want {FORMS}")
    if not line.isprintable():
        raise ValueError(f"holds several lines; want {FORMS}")
    if line != line.strip():
        raise ValueError("has a passphrase that begins or ends with a space: remove that, here and on the vehicle")
    secret = _hexadecimal(line)
    return SigningKey.from_passphrase(line) if secret is None else SigningKey(secret)


def _hexadecimal(line: str) -> bytes | None:
    if len(line) != 2 * KEY_SIZE or not set(line) <= set("0123456789abcdefABCDEF"):
        return None
    return bytes.fromhex(line)
