"""One bridge for an interface: two between the same buses would send the same frames round and round for ever."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from drivers.can.port import CanPortError


@contextmanager
def held(*channels: str) -> Iterator[None]:
    """Holds these interfaces as long as it lasts, or the process lives.

    By names in the abstract namespace of unix sockets: like interfaces, they are of one network namespace, and the
    kernel lets go of them when their owner dies.

    Raises:
        CanPortError: another bridge holds one of them.
    """
    with ExitStack() as names:
        for channel in channels:
            name = names.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
            try:
                name.bind(f"\0thruster-gateway bridge {channel}")
            except OSError as error:
                raise CanPortError(
                    f"{channel} is an end of another bridge of this machine; stop that first"
                ) from error
        yield
