"""The readings that come thousands of times a second, put together in a third of the time.

A frozen dataclass sets its fields one by one through `object.__setattr__`, which looks each up by its name; its slots
can be set directly. The readings are the same: these two functions are their constructors, with all fields in order.
"""

from __future__ import annotations

from drivers.readings import ThrusterCommand, ThrusterReport

_new = object.__new__
_command_time_s, _command_thruster, _command_fraction = (
    ThrusterCommand.__dict__[name].__set__ for name in ("time_s", "thruster", "fraction")
)
_REPORT = ("time_s", "thruster", "speed_rpm", "voltage_v", "current_a", "temperature_k", "error_count")
(
    _report_time_s,
    _report_thruster,
    _report_speed_rpm,
    _report_voltage_v,
    _report_current_a,
    _report_temperature_k,
    _report_error_count,
) = (ThrusterReport.__dict__[name].__set__ for name in _REPORT)


def thruster_command(time_s: float, thruster: int, fraction: float) -> ThrusterCommand:
    """`ThrusterCommand` of these fields."""
    command = _new(ThrusterCommand)
    _command_time_s(command, time_s)
    _command_thruster(command, thruster)
    _command_fraction(command, fraction)
    return command


def thruster_report(
    time_s: float,
    thruster: int,
    speed_rpm: float | None,
    voltage_v: float | None,
    current_a: float | None,
    temperature_k: float | None,
    error_count: int | None,
) -> ThrusterReport:
    """`ThrusterReport` of these fields."""
    report = _new(ThrusterReport)
    _report_time_s(report, time_s)
    _report_thruster(report, thruster)
    _report_speed_rpm(report, speed_rpm)
    _report_voltage_v(report, voltage_v)
    _report_current_a(report, current_a)
    _report_temperature_k(report, temperature_k)
    _report_error_count(report, error_count)
    return report
