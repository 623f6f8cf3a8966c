"""An AUTOSAR 4 system description of a CAN bus, as short as it can be."""

from __future__ import annotations

from dataclasses import dataclass

ORDERS = {"little": "MOST-SIGNIFICANT-BYTE-LAST", "big": "MOST-SIGNIFICANT-BYTE-FIRST"}
ENCODINGS = {"unsigned": "NONE", "signed": "2C", "float": "IEEE754"}


@dataclass(frozen=True)
class ArxmlSignal:
    """`start`: lowest bit (little endian) or highest bit (big endian), both counted from the lowest of each byte."""

    name: str
    start: int
    bits: int
    order: str = "little"
    kind: str = "unsigned"
    scale: float = 1.0
    offset: float = 0.0
    code: int | None = None  # of the selector that says that it is there


@dataclass(frozen=True)
class ArxmlMessage:
    name: str
    identifier: int
    extended: bool
    length: int
    signals: tuple[ArxmlSignal, ...]
    selector: ArxmlSignal | None = None


def arxml(messages):
    """The text of a file with these messages on one bus."""
    packages = {
        "Cluster": _cluster(messages),
        "Frames": "".join(map(_frame, messages)),
        "Pdus": "".join(map(_pdus, messages)),
        "Signals": "".join(_signal(one) for message in messages for one in _every(message)),
    }
    text = "".join(
        f"<AR-PACKAGE><SHORT-NAME>{name}</SHORT-NAME><ELEMENTS>{elements}</ELEMENTS></AR-PACKAGE>"
        for name, elements in packages.items()
    )
    return f'<AUTOSAR xmlns="http://autosar.org/schema/r4.0"><AR-PACKAGES>{text}</AR-PACKAGES></AUTOSAR>'


def _every(message):
    return [*message.signals, *([message.selector] if message.selector else [])]


def _cluster(messages):
    triggerings = "".join(
        f"<CAN-FRAME-TRIGGERING><SHORT-NAME>{one.name}</SHORT-NAME>"
        f'<FRAME-REF DEST="CAN-FRAME">/Frames/{one.name}</FRAME-REF>'
        f"<CAN-ADDRESSING-MODE>{'EXTENDED' if one.extended else 'STANDARD'}</CAN-ADDRESSING-MODE>"
        f"<IDENTIFIER>{one.identifier}</IDENTIFIER></CAN-FRAME-TRIGGERING>"
        for one in messages
    )
    return (
        "<CAN-CLUSTER><SHORT-NAME>Thrusters</SHORT-NAME><CAN-CLUSTER-VARIANTS><CAN-CLUSTER-CONDITIONAL>"
        "<PHYSICAL-CHANNELS><CAN-PHYSICAL-CHANNEL><SHORT-NAME>Channel</SHORT-NAME>"
        f"<FRAME-TRIGGERINGS>{triggerings}</FRAME-TRIGGERINGS></CAN-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS>"
        "</CAN-CLUSTER-CONDITIONAL></CAN-CLUSTER-VARIANTS></CAN-CLUSTER>"
    )


def _frame(message):
    kind = "MULTIPLEXED-I-PDU" if message.selector else "I-SIGNAL-I-PDU"
    return (
        f"<CAN-FRAME><SHORT-NAME>{message.name}</SHORT-NAME><FRAME-LENGTH>{message.length}</FRAME-LENGTH>"
        f"<PDU-TO-FRAME-MAPPINGS><PDU-TO-FRAME-MAPPING><SHORT-NAME>Whole</SHORT-NAME>"
        f'<PDU-REF DEST="{kind}">/Pdus/{message.name}</PDU-REF>'
        "<START-POSITION>0</START-POSITION></PDU-TO-FRAME-MAPPING></PDU-TO-FRAME-MAPPINGS></CAN-FRAME>"
    )


def _pdus(message):
    if message.selector is None:
        return _pdu(message.name, message.length, message.signals)
    codes = sorted({one.code for one in message.signals})
    parts = "".join(
        _pdu(f"{message.name}{code}", message.length, [one for one in _every(message) if one.code in (None, code)])
        for code in codes
    )
    alternatives = "".join(
        f'<DYNAMIC-PART-ALTERNATIVE><I-PDU-REF DEST="I-SIGNAL-I-PDU">/Pdus/{message.name}{code}</I-PDU-REF>'
        f"<SELECTOR-FIELD-CODE>{code}</SELECTOR-FIELD-CODE></DYNAMIC-PART-ALTERNATIVE>"
        for code in codes
    )
    selector = message.selector
    return parts + (
        f"<MULTIPLEXED-I-PDU><SHORT-NAME>{message.name}</SHORT-NAME><LENGTH>{message.length}</LENGTH>"
        f"<DYNAMIC-PARTS><DYNAMIC-PART><DYNAMIC-PART-ALTERNATIVES>{alternatives}</DYNAMIC-PART-ALTERNATIVES>"
        f"</DYNAMIC-PART></DYNAMIC-PARTS><SELECTOR-FIELD-BYTE-ORDER>{ORDERS[selector.order]}"
        f"</SELECTOR-FIELD-BYTE-ORDER><SELECTOR-FIELD-LENGTH>{selector.bits}</SELECTOR-FIELD-LENGTH>"
        f"<SELECTOR-FIELD-START-POSITION>{selector.start}</SELECTOR-FIELD-START-POSITION></MULTIPLEXED-I-PDU>"
    )


def _pdu(name, length, signals):
    mappings = "".join(
        f"<I-SIGNAL-TO-I-PDU-MAPPING><SHORT-NAME>{one.name}</SHORT-NAME>"
        f'<I-SIGNAL-REF DEST="I-SIGNAL">/Signals/{one.name}</I-SIGNAL-REF>'
        f"<PACKING-BYTE-ORDER>{ORDERS[one.order]}</PACKING-BYTE-ORDER>"
        f"<START-POSITION>{one.start}</START-POSITION></I-SIGNAL-TO-I-PDU-MAPPING>"
        for one in signals
    )
    return (
        f"<I-SIGNAL-I-PDU><SHORT-NAME>{name}</SHORT-NAME><LENGTH>{length}</LENGTH>"
        f"<I-SIGNAL-TO-PDU-MAPPINGS>{mappings}</I-SIGNAL-TO-PDU-MAPPINGS></I-SIGNAL-I-PDU>"
    )


def _signal(one):
    return (
        f"<SW-BASE-TYPE><SHORT-NAME>{one.name}Type</SHORT-NAME>"
        f"<BASE-TYPE-ENCODING>{ENCODINGS[one.kind]}</BASE-TYPE-ENCODING></SW-BASE-TYPE>"
        f"<COMPU-METHOD><SHORT-NAME>{one.name}Method</SHORT-NAME><CATEGORY>LINEAR</CATEGORY>"
        "<COMPU-INTERNAL-TO-PHYS><COMPU-SCALES><COMPU-SCALE><COMPU-RATIONAL-COEFFS>"
        f"<COMPU-NUMERATOR><V>{one.offset}</V><V>{one.scale}</V></COMPU-NUMERATOR>"
        "<COMPU-DENOMINATOR><V>1</V></COMPU-DENOMINATOR></COMPU-RATIONAL-COEFFS></COMPU-SCALE></COMPU-SCALES>"
        "</COMPU-INTERNAL-TO-PHYS></COMPU-METHOD>"
        f"<SYSTEM-SIGNAL><SHORT-NAME>{one.name}System</SHORT-NAME><PHYSICAL-PROPS><SW-DATA-DEF-PROPS-VARIANTS>"
        f'<SW-DATA-DEF-PROPS-CONDITIONAL><COMPU-METHOD-REF DEST="COMPU-METHOD">/Signals/{one.name}Method'
        "</COMPU-METHOD-REF></SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS></PHYSICAL-PROPS>"
        "</SYSTEM-SIGNAL>"
        f"<I-SIGNAL><SHORT-NAME>{one.name}</SHORT-NAME><LENGTH>{one.bits}</LENGTH><NETWORK-REPRESENTATION-PROPS>"
        f'<SW-DATA-DEF-PROPS-VARIANTS><SW-DATA-DEF-PROPS-CONDITIONAL><BASE-TYPE-REF DEST="SW-BASE-TYPE">/Signals/'
        f"{one.name}Type</BASE-TYPE-REF></SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS>"
        "</NETWORK-REPRESENTATION-PROPS>"
        f'<SYSTEM-SIGNAL-REF DEST="SYSTEM-SIGNAL">/Signals/{one.name}System</SYSTEM-SIGNAL-REF></I-SIGNAL>'
    )
