"""A demonstration without its bus and its links, as fast as it goes: what the gateway's drivers would read."""

from __future__ import annotations

from collections.abc import Iterator

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.mavlink.decoder import MavlinkDecoder
from drivers.readings import Reading, ThrusterCommand
from gateway.config_sections import MAVLINK
from hil_tests.demo.plan import COURSE, Plan
from hil_tests.rig import dvl
from hil_tests.rig.ardusub import ArduSub
from hil_tests.rig.embedded import Moment
from hil_tests.rig.helm import steer
from hil_tests.rig.instruments import Instruments
from hil_tests.rig.navigation import NavigationErrors, NavigationFilter
from hil_tests.rig.pilot import SURVEYING, Pilot
from hil_tests.rig.telemetry import COMPOSERS, Telemetry
from hil_tests.rig.vehicle import Vehicle, mix

PERIOD_S = 0.01
# Steps from one message to the next, at the rates that the gateway asks for.
STEPS = {
    mavlink.MAVLINK_MSG_ID_RAW_IMU: 2,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 5,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 10,
    mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE2: 10,
}


class Rehearsal:
    """Vehicle, pilot and sensors, stepped together.

    Args:
        script: what happens when.
        seed: of pilot and noise.

    Attributes:
        moments: the truth so far, ten times a second.
    """

    def __init__(self, script: Plan, seed: int) -> None:
        around = script.surroundings()
        self._seconds = script.seconds
        self._vehicle = Vehicle(PERIOD_S, seed, script.faults(), water=around.water, hull_faults=around.hull_faults)
        self._pilot, self._seen = Pilot(seed, SURVEYING), NavigationFilter(NavigationErrors(), seed)
        self._instruments = Instruments(around.equipment, seed, self._vehicle.hull.motion)
        self._decoder = MavlinkDecoder([], autopilot_system=1, navigation=True)
        self._autopilot = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._dvl = mavlink.MAVLink(None, srcSystem=dvl.SYSTEM_ID, srcComponent=dvl.COMPONENT_ID)
        self.moments: list[Moment] = []

    def readings(self) -> Iterator[tuple[str, list[Reading]]]:
        """Links, and what is read on them, in order of time from 0 on."""
        motion = self._vehicle.hull.motion
        for step in range(round(self._seconds / PERIOD_S)):
            time_s = step * PERIOD_S
            commands = mix(steer(COURSE, time_s, self._pilot.sticks(time_s), motion))
            motion = self._vehicle.step(time_s, commands)
            self._instruments.step(motion, PERIOD_S)
            if step % 5 == 0:
                self._seen.advance(time_s)
            if step % 10 == 0:
                self.moments.append(Moment(time_s, motion))
            if step % 2 == 0:
                pushing = enumerate(commands[:4], start=1)
                yield "can0", [ThrusterCommand(time_s, number, command) for number, command in pushing]
            telemetry = Telemetry(time_s, self._seen.seen(motion), commands, self._instruments)
            if data := self._said(step, telemetry):
                yield MAVLINK, self._decoder.decode(data, time_s)

    def _said(self, step: int, telemetry: Telemetry) -> bytes:
        """All messages of a step."""
        data = b""
        for message_id, steps in STEPS.items():
            if step % steps == 0 and (message := COMPOSERS[message_id](telemetry, ArduSub())):
                data += message.pack(self._autopilot)
        if velocity := self._instruments.vision_position_delta(telemetry.boot_s):
            data += velocity.pack(self._dvl)
        return data
