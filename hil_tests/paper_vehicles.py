"""The three vehicles of paper 000, tables 1-3, as simulated thrusters: command in, measured propeller speed out.

What the tables state (kind and range of the command, top speed, sensor) is taken from them. What they do not state
(the rest of `ThrusterPlant`) is assumed, in the range of such drives.

The drive is open loop, as most are by the paper's section 4.1. The applied voltage, less what friction takes, splits
into the back-EMF and the drop over the windings, which grows with the propeller's torque; and the torque grows with
the square of the speed, less as water already flows through the propeller (K_Q falls with the advance ratio). With x
the speed and e the voltage as parts of their greatest, w the inflow as a part of the advance speed at which the
torque would vanish at top speed, and L the load (1 healthy, more with weeds around the shaft):

    e = (1 - b) x + b L x (x - w)        b: share of the voltage that drops over the windings at top speed, w = 0

So the curve from command to speed is no straight line, and the same command gives another speed when the vehicle
moves, is dragged, or meets currents, waves and turbulence: in the paper's words, it depends on the working state.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

PERIOD_S = 0.1  # the paper speaks of sampling periods and leaves their length open


@dataclass(frozen=True, slots=True, kw_only=True)
class ThrusterPlant:
    """One vehicle's thruster with its speed sensor.

    Attributes:
        name: of the vehicle.
        command_max: greatest command (tables 1-3), in the command's unit.
        speed_max_rpm: speed at that command in still water (tables 1-3).
        winding_share: b above.
        friction_share: share of the greatest voltage below which the shaft stands still.
        lag_s: time constant of the shaft's speed.
        delay: samples from the command to the motor: bus, controller, driver.
        surge_s: time constant with which the vehicle's own speed follows its thruster.
        surge_inflow: w at the vehicle's top speed.
        edges_per_turn: of the Hall sensor; its speed is edges over the time between the first and the last of them.
        timer_s: resolution with which edges are timed.
        ripple: error of a reading, as a part of it (unequal magnets, torque ripple), standard deviation.
        reported_step_rpm: step in which the speed is transmitted; 0.0 for none.
    """

    name: str
    command_max: float
    speed_max_rpm: float
    winding_share: float
    friction_share: float
    lag_s: float
    delay: int
    surge_s: float
    surge_inflow: float
    edges_per_turn: int
    timer_s: float
    ripple: float
    reported_step_rpm: float = 0.0

    def steady_speed(self, drive: float, inflow: float, load: float) -> float:
        """x above, 0 or more, for e = `drive` in 0..1: the positive root of b L x^2 + (1 - b - b L w) x - e = 0."""
        e = max(drive - self.friction_share, 0.0) / (1.0 - self.friction_share)
        b = self.winding_share
        linear = 1.0 - b - b * load * inflow
        return 2.0 * e / (linear + sqrt(linear**2 + 4.0 * b * load * e))


HOV = ThrusterPlant(
    name="HOV, sea trial",
    command_max=5.0,
    speed_max_rpm=700.0,
    winding_share=0.3,
    friction_share=0.05,
    lag_s=0.3,
    delay=3,
    surge_s=20.0,
    surge_inflow=0.4,
    edges_per_turn=24,
    timer_s=1e-4,
    ripple=0.002,
)
SAUCER = ThrusterPlant(
    name="saucer AUV, pool test",
    command_max=5.0,
    speed_max_rpm=1200.0,
    winding_share=0.12,
    friction_share=0.03,
    lag_s=0.05,
    delay=2,
    surge_s=5.0,
    surge_inflow=0.1,
    edges_per_turn=42,
    timer_s=5e-5,
    ripple=0.0008,
)
PORTABLE = ThrusterPlant(
    name="portable AUV, sea trial",
    command_max=100.0,
    speed_max_rpm=500.0,
    winding_share=0.2,
    friction_share=0.03,
    lag_s=0.05,
    delay=2,
    surge_s=8.0,
    surge_inflow=0.4,
    edges_per_turn=42,
    timer_s=5e-5,
    ripple=0.001,
    reported_step_rpm=1.0,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Circumstances:
    """What happens to the thruster besides its command, sample by sample: four series of one length.

    Attributes:
        inflow: w above, from everything but the vehicle's own way: current, waves, turbulence, being dragged.
        supply: supply voltage as a part of the nominal one.
        load: L above.
        blocked: True where the shaft is held fast.
    """

    inflow: FloatArray
    supply: FloatArray
    load: FloatArray
    blocked: NDArray[np.bool_]


def simulate(
    plant: ThrusterPlant, command: FloatArray, around: Circumstances, rng: np.random.Generator
) -> FloatArray:
    """Measured speed in rpm of every sample, signed like the direction of rotation."""
    delayed = np.concatenate((np.full(plant.delay, command[0]), command[: len(command) - plant.delay]))
    drive = delayed / plant.command_max * around.supply
    keep, keep_way = np.exp(-PERIOD_S / plant.lag_s), np.exp(-PERIOD_S / plant.surge_s)
    speed, way = 0.0, 0.0
    true_rpm = np.empty(len(command))
    for i, e in enumerate(drive):
        ahead = 1.0 if e >= 0.0 else -1.0
        inflow = ahead * (plant.surge_inflow * way + around.inflow[i])
        target = 0.0 if around.blocked[i] else ahead * plant.steady_speed(abs(e), inflow, around.load[i])
        speed = target + keep * (speed - target)
        way = speed + keep_way * (way - speed)
        true_rpm[i] = speed * plant.speed_max_rpm
    return measure(plant, true_rpm, rng)


def measure(plant: ThrusterPlant, true_rpm: FloatArray, rng: np.random.Generator) -> FloatArray:
    """What the Hall sensor says: whole edges over their time in whole timer ticks, then whole reported steps."""
    uneven = true_rpm * (1.0 + plant.ripple * rng.normal(size=len(true_rpm)))
    edges_per_s = np.abs(uneven) * plant.edges_per_turn / 60.0
    edges = np.floor(edges_per_s * PERIOD_S)
    ticks = np.round(edges / np.maximum(edges_per_s, 1e-9) / plant.timer_s)
    rpm = np.sign(uneven) * np.where(
        edges > 0, 60.0 / plant.edges_per_turn * edges / np.maximum(ticks * plant.timer_s, 1e-9), 0.0
    )
    step = plant.reported_step_rpm
    return np.asarray(np.round(rpm / step) * step if step else rpm)
