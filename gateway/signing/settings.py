"""What the [mavlink] table says of signing: what contradicts itself, and what the link accepts."""

from __future__ import annotations

from collections.abc import Iterator

from gateway.config_sections import Mavlink
from gateway.problems import Problem


def contradictions(mavlink: Mavlink) -> Iterator[Problem]:
    """Keys that mean nothing without a key to sign with."""
    if mavlink.signing_key is not None:
        return
    for key in ("accept_unsigned", "signing_link_id"):
        if key in mavlink.model_fields_set:
            wanted = "means nothing without mavlink.signing_key: nothing is signed, and all is accepted"
            yield Problem(f"mavlink.{key}", getattr(mavlink, key), wanted)


def accepted(mavlink: Mavlink) -> str:
    """What the link accepts, in words."""
    return f"{_telemetry(mavlink)}; {_commands(mavlink)}"


def _telemetry(mavlink: Mavlink) -> str:
    if mavlink.signing_key is None:
        return "packets of everybody, signed or not (no mavlink.signing_key)"
    if mavlink.accept_unsigned:
        return f"packets signed with the key in {mavlink.signing_key.name}, and unsigned ones"
    return f"only packets signed with the key in {mavlink.signing_key.name}"


def _commands(mavlink: Mavlink) -> str:
    if not mavlink.operators:
        return "commands to us from nobody"
    systems = f"system{'s' if len(mavlink.operators) > 1 else ''} {', '.join(map(str, mavlink.operators))}"
    return f"commands to us from {systems}, {'unsigned, too' if mavlink.signing_key is None else 'signed only'}"
