"""Which CAN frames an autopilot is to forward: CAN_FILTER_MODIFY, as ArduPilot reads it (AP_MAVLinkCAN.cpp).

It compares one number of 16 bits for each frame, made of the identifier as if every frame were DroneCAN: the data
type id, of messages 16 bits and of services 8; 0 where the node id is 0 (an anonymous node). A frame of another
protocol has such a number, too, so that exact identifiers can be filtered by it, if coarsely: 128 standard
identifiers that lie side by side have one number or two.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from drivers.can.frame import EXTENDED_MASK, STANDARD_MASK, CanFilter
from drivers.mavlink.messages import FILTER_IDS_MAX, CanFilterModify, FilterOperation

LOW_BYTE, SERVICE_BIT = 0xFF, 0x80
MIDDLE_MASK, SERVICE_MASK = 0xFFFF00, 0xFF0000


def forwarding_ids(filters: Iterable[CanFilter]) -> tuple[int, ...] | None:
    """The numbers of all frames that these filters want, ascending; None where no list of numbers says that.

    A frame of an anonymous node is not among them, unless a filter names its identifier.
    """
    ids: set[int] = set()
    for one in filters:
        found = _ids(one)
        if found is None:
            return None
        ids |= found
    return tuple(sorted(ids)) or None


def _ids(wanted: CanFilter) -> set[int] | None:
    # all that a short identifier lacks is 0
    mask = wanted.mask if wanted.extended else wanted.mask | (EXTENDED_MASK & ~STANDARD_MASK)
    low = wanted.identifier & mask & LOW_BYTE
    if mask & LOW_BYTE == LOW_BYTE and low == 0:
        return {0}
    ids: set[int] = set()
    for service in (False, True):
        if (bool(low & SERVICE_BIT) != service) and mask & SERVICE_BIT:
            continue
        needed = SERVICE_MASK if service else MIDDLE_MASK
        if mask & needed != needed:
            return None
        ids.add((wanted.identifier & needed) >> (16 if service else 8))
    return ids


def filter_messages(
    ids: Sequence[int] | None, bus: int, target_system: int, target_component: int, *, anew: bool
) -> list[CanFilterModify]:
    """What makes the autopilot forward these and no others; sent again, it changes nothing.

    Args:
        ids: as of `forwarding_ids`; None: all frames, whatever filter somebody else has left there.
        bus: of the autopilot, from 1.
        target_system, target_component: the autopilot.
        anew: ids that are there already are removed; False: those of a list longer than a message are left.
    """
    listed = tuple(ids or ())
    chunks = [listed[i : i + FILTER_IDS_MAX] for i in range(0, len(listed), FILTER_IDS_MAX)] or [()]
    first = FilterOperation.REPLACE if anew or len(chunks) == 1 else FilterOperation.ADD
    operations = [first, *[FilterOperation.ADD] * (len(chunks) - 1)]
    return [
        CanFilterModify(bus, operation, chunk, target_system, target_component)
        for operation, chunk in zip(operations, chunks, strict=True)
    ]
