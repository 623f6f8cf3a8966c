"""The words of the command line for bridges: two buses, two endpoints."""

from __future__ import annotations

from drivers.mavlink.endpoint import parse_endpoint


def parse_buses(text: str) -> tuple[str, str]:
    """`--bridge can0:can1`: the bus with the autopilot, then that with the ESCs.

    Raises:
        ValueError: not two different names.
    """
    names = text.split(":")
    if len(names) != 2 or not all(names) or names[0] == names[1]:
        wanted = "want two interfaces, that of the autopilot first, such as can0:can1"
        raise ValueError(f"--bridge {text!r}: {wanted}")
    return names[0], names[1]


def parse_endpoints(text: str) -> tuple[str, str]:
    """`--bridge-mavlink ENDPOINT=ENDPOINT`: that of the autopilot, then that of the gateway.

    Raises:
        ValueError: not two different endpoints.
    """
    endpoints = text.split("=")
    if len(endpoints) != 2 or endpoints[0] == endpoints[1]:
        example = "udpin:0.0.0.0:14550=udpout:127.0.0.1:14551"
        raise ValueError(
            f"--bridge-mavlink {text!r}: want two endpoints, that of the autopilot first, such as {example}"
        )
    for endpoint in endpoints:
        try:
            parse_endpoint(endpoint)
        except ValueError as error:
            raise ValueError(f"--bridge-mavlink {text!r}: {error}") from error
    return endpoints[0], endpoints[1]
