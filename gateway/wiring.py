"""From the configuration to the drivers: which decoder a link gets, and what each thruster is on that link."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from drivers.can.dbc import DbcDecoder, DbcThruster
from drivers.can.dbc_database import load_database
from drivers.can.decoder import CanDecoder
from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.vesc import VescDecoder, VescThruster
from drivers.command import CommandScale
from drivers.mavlink.decoder import MavlinkDecoder, MavlinkThruster
from drivers.mavlink.forwarded_frames import ForwardedFrames
from drivers.mavlink.frames import Gate
from gateway.config_sections import MAVLINK, CanBus, CommandSource, Mavlink, Thruster

# Blue Robotics' Basic ESC, and ArduSub's own defaults: us
PWM_MINIMUM_US, PWM_NEUTRAL_US, PWM_MAXIMUM_US, PWM_DEAD_BAND_US = 1100.0, 1500.0, 1900.0, 25.0
# kinds of control of a VESC whose full command is the vehicle's, and not 1
UNITS_OF_FULL_THRUST = {"current": "A", "rpm": "electrical rpm"}


def command_scale(source: CommandSource) -> CommandScale:
    """Scale of a command in the unit of its wire; what is left out is as for a Basic ESC on a servo output, and for a
    VESC's duty cycle or relative current from -1 to 1.

    Raises:
        ValueError: numbers that make no scale.
    """
    if source.control is not None:
        return _vesc_scale(source)
    return CommandScale(
        minimum=PWM_MINIMUM_US if source.minimum is None else source.minimum,
        neutral=PWM_NEUTRAL_US if source.neutral is None else source.neutral,
        maximum=PWM_MAXIMUM_US if source.maximum is None else source.maximum,
        dead_band=source.dead_band if source.dead_band is not None else _default_dead_band(source),
        reverse=source.reverse,
    )


def _default_dead_band(source: CommandSource) -> float:
    """That of a Basic ESC on outputs in microseconds: an actuator's are by default, and may be in any other unit."""
    in_us = source.servo_channel is not None or (source.actuator is not None and source.minimum is None)
    return PWM_DEAD_BAND_US if in_us else 0.0


def can_decoder(bus: CanBus, thrusters: Sequence[Thruster]) -> CanDecoder:
    """The decoder of a bus, for the thrusters that are wired to it.

    Raises:
        ValueError: a signal that the bus's database does not have.
    """
    if bus.protocol == "dronecan":
        return DroneCanDecoder([_dronecan(one, bus) for one in thrusters if _uses(one, bus.name)])
    if bus.protocol == "vesc":
        return VescDecoder([_vesc(one, bus.name) for one in thrusters if _uses(one, bus.name)])
    if bus.database is None:
        raise ValueError(f"can[name={bus.name}].database: missing, a bus with a database needs its file")
    return DbcDecoder(bus.database, [part for one in thrusters if (part := _dbc(one, bus.name)) is not None])


def mavlink_decoder(
    mavlink: Mavlink,
    thrusters: Sequence[Thruster],
    navigation: bool = False,
    gate: Gate | None = None,
    can_frames: ForwardedFrames | None = None,
) -> MavlinkDecoder:
    """The decoder of the autopilot's link, for the thrusters that are wired to it, navigation sensors, and CAN."""
    wired = mavlink_thrusters(thrusters)
    return MavlinkDecoder(
        wired, mavlink.component_id, mavlink.system_id, navigation, gate, mavlink.operators, can_frames
    )


def mavlink_thrusters(thrusters: Sequence[Thruster]) -> list[MavlinkThruster]:
    """What the autopilot's messages, or its logs, say of thrusters that are wired to it."""
    return [_mavlink(one) for one in thrusters if _uses(one, MAVLINK)]


def refused_signals(bus: CanBus, database: Path, thrusters: Sequence[Thruster]) -> Iterator[tuple[str, object, str]]:
    """What a bus cannot read of its database or of its thrusters: (key path, value, what the driver says)."""
    try:
        loaded = load_database(database)
    except ValueError as error:
        yield f"can[name={bus.name}].database", database, str(error)
        return
    for thruster in thrusters:
        path = f"thruster[number={thruster.number}]"
        for key in ("command", "rpm"):
            source = getattr(thruster, key)
            if source.link != bus.name or source.signal is None:
                continue
            try:
                DbcDecoder(loaded, [_dbc_command(thruster) if key == "command" else _dbc_speed(thruster)])
            except ValueError as error:
                yield f"{path}.{key}", source.model_dump(exclude_unset=True, exclude={"link"}), str(error)


def _uses(thruster: Thruster, link: str) -> bool:
    return link in (thruster.command.link, thruster.rpm.link)


def _dronecan(thruster: Thruster, bus: CanBus) -> DroneCanThruster:
    command, rpm = thruster.command, thruster.rpm
    esc_index = command.esc_index if command.link == bus.name else rpm.esc_index
    return DroneCanThruster(
        thruster=thruster.number,
        esc_index=esc_index or 0,
        bidirectional_command=command.bidirectional,
        maximum_rpm=command.maximum_rpm,
        reverse=command.reverse if command.link == bus.name else rpm.reverse,
        signed=rpm.signed is not False,
        node_id=rpm.node_id,
    )


def _vesc_scale(source: CommandSource) -> CommandScale:
    maximum = 1.0 if source.maximum is None else source.maximum
    return CommandScale(
        minimum=-maximum if source.minimum is None else source.minimum,
        neutral=0.0,
        maximum=maximum,
        dead_band=source.dead_band or 0.0,
        reverse=source.reverse,
    )


def _vesc(thruster: Thruster, link: str) -> VescThruster:
    command, rpm = thruster.command, thruster.rpm
    commanded, measured = command.link == link, rpm.link == link
    return VescThruster(
        thruster=thruster.number,
        controller_id=(command.controller_id if commanded else rpm.controller_id) or 0,
        control=command.control if commanded else None,
        command_scale=command_scale(command) if commanded else None,
        pole_pairs=rpm.pole_pairs if measured else None,
        signed=rpm.signed is not False,
        reverse=rpm.reverse and measured,
    )


def _dbc(thruster: Thruster, link: str) -> DbcThruster | None:
    command = _dbc_command(thruster) if thruster.command.link == link else None
    speed = _dbc_speed(thruster) if thruster.rpm.link == link else None
    if command is None or speed is None:
        return command or speed
    return DbcThruster(
        thruster=thruster.number,
        command=command.command,
        command_scale=command.command_scale,
        speed=speed.speed,
        speed_unit=speed.speed_unit,
        pole_pairs=speed.pole_pairs,
        signed=speed.signed,
        reverse=speed.reverse,
        voltage=speed.voltage,
        current=speed.current,
    )


def _dbc_command(thruster: Thruster) -> DbcThruster:
    source = thruster.command
    return DbcThruster(thruster.number, command=source.signal, command_scale=command_scale(source))


def _dbc_speed(thruster: Thruster) -> DbcThruster:
    source = thruster.rpm
    return DbcThruster(
        thruster=thruster.number,
        speed=source.signal,
        speed_unit=source.unit,
        pole_pairs=source.pole_pairs,
        signed=source.signed is not False,
        reverse=source.reverse,
        voltage=source.voltage,
        current=source.current,
    )


def _mavlink(thruster: Thruster) -> MavlinkThruster:
    command, rpm = thruster.command, thruster.rpm
    commanded, measured = command.link == MAVLINK, rpm.link == MAVLINK
    return MavlinkThruster(
        thruster=thruster.number,
        servo_channel=command.servo_channel if commanded else None,
        actuator=command.actuator if commanded else None,
        command_scale=command_scale(command) if commanded else None,
        esc_index=rpm.esc_index if measured else None,
        signed=bool(rpm.signed) and measured,
        reverse=rpm.reverse and measured,
        rpm_sensor=rpm.rpm_sensor if measured else None,
    )
