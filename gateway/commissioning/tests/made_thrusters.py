"""Made-up dives of thrusters, healthy or not, as commissioning gets them."""

import numpy as np

from detectors.thruster.tests.simulation import Thruster, working
from detectors.verdict import Level
from gateway.commissioning.dive import RecordedDive, ThrusterSamples
from gateway.config import parse
from gateway.findings import Finding
from gateway.severity import Severity

RATE_HZ = 10.0

CONFIG = """# what the owner says of it
[vehicle]
name = "Made up"   # and of its name

[[can]]
name = "can0"
interface = "virtual"
channel = "can0"
protocol = "dronecan"

[[thruster]]
number = 1
command = { link = "can0", esc_index = 0 }
rpm = { link = "can0", esc_index = 0 }

[[thruster]]
number = 2
name = "rear"
command = { link = "can0", esc_index = 1 }
rpm = { link = "can0", esc_index = 1 }

[align]
gap_s = 0.5   # left as it is
"""


def config(folder, text=CONFIG):
    return parse(text, folder)


def samples(seconds=360.0, seed=1, thruster=None, gain=1.0, reach=1.0, rate_hz=RATE_HZ, start_s=1000.0):
    """One thruster, driven both ways."""
    count = int(seconds * rate_hz)
    command = reach * working(count, seed)
    made = (thruster or Thruster(delay=1, lag=1.5)).simulate(command, gain=gain, seed=seed)
    unmeasured = np.full(count, np.nan)
    time_s = start_s + np.arange(count) / rate_hz
    return ThrusterSamples(rate_hz, time_s, made.command, made.speed_rpm, unmeasured, unmeasured)


def dive(thrusters, name="dive", findings=()):
    """A dive of some thrusters."""
    begin_s = min(float(one.time_s[0]) for one in thrusters.values())
    end_s = max(float(one.time_s[-1]) for one in thrusters.values())
    return RecordedDive(name, begin_s, end_s - begin_s, thrusters, [], [], list(findings))


def fault(time_s, subject="thruster 1", level=Level.FAULT):
    """What the gateway says of a thruster."""
    return Finding(time_s, "thruster", subject, level, 1.2, "T1 entangled? 900 rpm, want 1200", Severity.CRITICAL)
