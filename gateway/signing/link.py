"""Signing on the link to the autopilot in one run: key and stamps from their files, and words for refusals."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

from drivers.mavlink.signing import FUTURE, TOO_MANY, TOO_OLD, UNSIGNED, WRONG_KEY, Signing, SigningKey
from gateway.config_sections import MAVLINK, Mavlink
from gateway.problems import ConfigError, Problem
from gateway.signing.key import KeyFileError, read_key
from gateway.signing.memory import KEEP_S, SigningMemory

STAMPS_SUFFIX = ".stamps"  # of the file beside the state

# What to do about each kind of refusal; what came twice or late is nothing that a user could mend.
ADVICE: Mapping[str, str] = {
    UNSIGNED: "it does not sign: give it the key as well, or set mavlink.accept_unsigned = true",
    WRONG_KEY: "it signs with another key: compare mavlink.signing_key with the vehicle's and the ground station's",
    TOO_OLD: "its clock is over a minute behind: set mavlink.system_id, and it hears ours first and follows",
    FUTURE: "its clock is more than ten years ahead: set it right, and then its key anew",
    TOO_MANY: "too many senders share the key: which of them change their ids?",
}


class LinkSigning:
    """Signing whose stamps are kept in a file.

    Args:
        signing: as it begins, see `begun`.
        state: the state file, beside which the stamps are kept.
        time_s: now, unix.

    Attributes:
        signing: for decoder and encoder.
    """

    def __init__(self, signing: Signing, state: Path, time_s: float) -> None:
        self.signing = signing
        self._memory = _memory(state)
        self._told: set[str] = set()
        self._keep(time_s)

    def advance(self, time_s: float) -> None:
        """Keeps the stamps when that is due."""
        if time_s - self._kept_s >= KEEP_S:
            self._keep(time_s)

    def close(self, time_s: float) -> None:
        """Keeps the stamps for the last time: nothing is sent after it."""
        self._kept_s = math.inf
        self._memory.close(self.signing.history(time_s, reserve=False))

    def news(self, drops: Counter[str]) -> Iterator[str]:
        """What must be said of the packets that were refused: each kind once.

        Args:
            drops: of the decoder.
        """
        for cause in ADVICE:
            if drops[cause] and cause not in self._told:
                self._told.add(cause)
                yield f"mavlink: a packet was refused ({cause}); {ADVICE[cause]}; gateway check says whose"

    def _keep(self, time_s: float) -> None:
        self._kept_s = time_s
        self._memory.keep(self.signing.history(time_s))


def link_signing(mavlink: Mavlink, state: Path, time_s: float) -> LinkSigning | None:
    """The signing of a run; None where no key is set.

    Raises:
        ConfigError: see `begun`.
    """
    signing = begun(mavlink, state, time_s)
    return None if signing is None else LinkSigning(signing, state, time_s)


def begun(mavlink: Mavlink, state: Path, time_s: float) -> Signing | None:
    """Signing that goes on where the last run ended, without keeping anything; None where no key is set.

    Raises:
        ConfigError: the key file cannot be used.
    """
    if mavlink.signing_key is None:
        return None
    history = _memory(state).recall(time_s)
    return Signing(_key(mavlink.signing_key), time_s, mavlink.signing_link_id, mavlink.accept_unsigned, history)


def replayed(mavlink: Mavlink, time_s: float) -> Signing | None:
    """Signing as a run began it that knew of no run before; None where no key is set.

    Args:
        mavlink: the settings.
        time_s: when it began, unix.

    Raises:
        ConfigError: the key file cannot be used.
    """
    if mavlink.signing_key is None:
        return None
    return Signing(_key(mavlink.signing_key), time_s, mavlink.signing_link_id, mavlink.accept_unsigned)


def _memory(state: Path) -> SigningMemory:
    return SigningMemory(state.with_name(state.name + STAMPS_SUFFIX))


def _key(path: Path) -> SigningKey:
    try:
        return read_key(path)
    except KeyFileError as error:
        raise ConfigError(MAVLINK, [Problem("mavlink.signing_key", path, str(error))]) from error
