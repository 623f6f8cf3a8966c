"""What was learnt of the navigation sensors, as settings for the file and in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import degrees

from detectors.navigation import NavigationConfig
from gateway.commissioning.mounting import Known, Mounting
from gateway.commissioning.navigation_learnt import Learnt, Threshold, noises
from gateway.commissioning.navigation_watch import THRESHOLDS, scaled
from gateway.commissioning.part import Quantity, Setting, Value
from gateway.commissioning.peaks import counted

TABLE = "detector.navigation"
SCALE_TOLD = 0.02  # a DVL that measures so much too much or too little is set up wrongly
DRIFT_TOLD = 5e-4  # of a clock; half a second in a quarter of an hour


def settings_of(learnt: Learnt, config: NavigationConfig, threshold: Threshold) -> Iterator[Setting]:
    taught, mounting = learnt.settings(config), learnt.mounting
    for name in noises(learnt.noise, config):
        yield Setting(f"{TABLE}.{name}", getattr(taught, name), _NOISE_COMMENTS[name])
    if mounting is not None:
        arm: list[Value] = [*taught.dvl_lever_arm_m]
        angles: list[Value] = [round(degrees(one), 2) for one in taught.dvl_mounting_rad]
        yield Setting("navigation.dvl_lever_arm_m", arm, _doubts(mounting.lever_arm_m, 1.0, "m"))
        yield Setting("navigation.dvl_mounting_deg", angles, _doubts(mounting.rotation_rad, degrees(1.0), "degrees"))
        if mounting.delay_s.enough:
            drifts = f"+-{mounting.delay_s.error:.2f} s when a dive begins; drifts by {_a_minute(mounting)}"
            yield Setting("navigation.dvl_delay_s", taught.dvl_delay_s, drifts)
    if threshold.share != 1.0:
        comment = (
            f"{threshold.share:.2f} times the configured threshold: {threshold.wanted_per_hour:g} an hour by "
            f"{threshold.hours:.2f} h of these dives"
        )
        name = THRESHOLDS[config.method]
        yield Setting(f"{TABLE}.{name}", float(f"{scaled(config, threshold.share):.2g}"), comment)


_NOISE_COMMENTS = {
    "accelerometer_noise_mps2": "per root Hz, of the noisiest axis",
    "gyroscope_noise_radps": "per root Hz, of the noisiest axis",
    "dvl_noise_mps": "on straight legs",
    "depth_noise_m": "motion included",
}


def _doubts(known: Sequence[Known], unit: float, name: str) -> str:
    each = (f"{unit * one.error:.2f}" if one.enough else "not learnt" for one in known)
    return f"+- {', '.join(each)} {name}"


def quantities_of(learnt: Learnt) -> Iterator[Quantity]:
    noise, mounting = learnt.noise, learnt.mounting
    calm, restless = "Allan deviation, calmest windows", "at most: the vehicle never held still"
    rows = (
        (
            "accelerometer noise",
            noise.accelerometer_mps2,
            "m/s2/rtHz",
            restless if noise.accelerometer_bound else calm,
        ),
        ("gyroscope noise", noise.gyroscope_radps, "rad/s/rtHz", restless if noise.gyroscope_bound else calm),
        ("DVL noise", noise.dvl_mps, "m/s", f"{noise.pairs} pairs of samples on straight legs"),
        ("depth noise", noise.depth_m, "m", "of what the filter expects"),
    )
    yield from (Quantity(name, f"{value:.2g} {unit}", sure) for name, value, unit, sure in rows if value is not None)
    if mounting is None:
        return
    axes = zip(("forward", "right", "down"), mounting.lever_arm_m, strict=True)
    yield from (_quantity(f"DVL {axis} of the IMU", one, 1.0, "m", mounting) for axis, one in axes)
    turns = zip(("roll", "pitch", "yaw"), mounting.rotation_rad, strict=True)
    yield from (_quantity(f"DVL {axis}", one, degrees(1.0), "degrees", mounting) for axis, one in turns)
    yield _quantity("DVL delay when a dive begins", mounting.delay_s, 1.0, "s", mounting)
    yield Quantity("drift of the DVL's delay", _a_minute(mounting), "median of the dives")
    yield _quantity("DVL scale", mounting.scale, 100.0, "%", mounting)
    yield _quantity("depth sensor forward of the IMU", mounting.depth_arm_m, 1.0, "m", mounting)
    yield _quantity("depth delay", mounting.depth_delay_s, 1.0, "s", mounting)


def _a_minute(mounting: Mounting) -> str:
    return f"{60.0 * mounting.drift:+.3f} s a minute"


def _quantity(name: str, known: Known, unit: float, unit_name: str, mounting: Mounting) -> Quantity:
    sure = f"+-{unit * known.error:.2f} {unit_name}, of {_dives(mounting.dives)}"
    if known.spread:
        sure += f"; differs by {unit * known.spread:.2f} {unit_name} from dive to dive"
    return Quantity(name, f"{unit * known.value:+.2f} {unit_name}", sure if known.enough else f"{sure}; not used")


def _dives(count: int) -> str:
    return "1 dive" if count == 1 else f"{count} dives"


def threshold_quantities(threshold: Threshold) -> Iterator[Quantity]:
    if threshold.hours <= 0.0:
        return
    bound = counted(threshold.events, threshold.hours).bound_per_hour
    by = "settings of the other dives" if threshold.held_out else "settings of the same dive"
    sure = f"in {threshold.hours:.2f} h with the {by}; below {bound:.{1 if bound < 10.0 else 0}f} an hour (95 %)"
    yield Quantity(
        "threshold", f"{threshold.share:.2f} times the configured one", "as configured" * (not threshold.law)
    )
    yield Quantity("exceeded in healthy dives", f"{threshold.events} times", sure)


def remarks_of(learnt: Learnt, threshold: Threshold) -> Iterator[str]:
    mounting = learnt.mounting
    if threshold.law is None:
        yield "too short to learn a threshold: it stays as it is; ten minutes are enough for one"
    if not threshold.held_out:
        yield "one dive alone: what it has taught was tried on itself; with a second one it is tried on the other"
    if mounting is None:
        return
    if mounting.scale.enough and abs(mounting.scale.value) > SCALE_TOLD:
        yield (
            f"the DVL measures {100.0 * mounting.scale.value:+.1f} % more than the speed: look at its speed of "
            "sound (salinity, temperature)"
        )
    if abs(mounting.drift) > DRIFT_TOLD:
        yield (
            f"the DVL's clock and the inertial unit's drift apart by {_a_minute(mounting)}: the watch follows that, "
            "but foresees turns less well; let one set the other"
        )
    for name, one in zip(("roll", "pitch", "yaw"), mounting.rotation_rad, strict=True):
        if not one.enough:
            yield f"the DVL's {name} is not known, and stays as it is: {_ANGLES[name]}"


_ANGLES = {
    "roll": "drive sideways for a minute",
    "pitch": "drive ahead for a minute at an even depth",
    "yaw": "drive ahead for a minute, with turns to both sides",
}
