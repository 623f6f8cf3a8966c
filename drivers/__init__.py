"""Bytes to readings, messages to bytes. A wire format is a pure module; a transport is another."""
