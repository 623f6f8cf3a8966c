"""`gateway demo`: the real gateway against an embedded simulated vehicle that gets weeds into a thruster, drives into
a current and catches a net."""

from hil_tests.demo.command import demo

__all__ = ["demo"]
