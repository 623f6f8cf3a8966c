"""The simulated thruster: the maker's figures, the equations it claims to solve, the signatures of faults."""

from __future__ import annotations

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from hil_tests.rig.faults import FaultType, InjectedFault, strengths
from hil_tests.rig.thruster import T200, SimulatedThruster, ThrusterState

PERIOD_S = 0.01
PROMPT = replace(T200, delay_s=0.0)


def run(commands, parameters=T200, faults=(), supply_v=16.0, period_s=PERIOD_S) -> list[ThrusterState]:
    thruster = SimulatedThruster(period_s, seed=1, parameters=parameters, faults=faults)
    return [thruster.step(index * period_s, command, supply_v) for index, command in enumerate(commands)]


def settle(command, **settings) -> ThrusterState:
    return run([command] * 300, **settings)[-1]


def injected(kind, severity=1.0, onset_s=0.0, **more) -> InjectedFault:
    return InjectedFault(type=kind, onset_s=onset_s, severity=severity, **more)


def test_full_throttle_is_what_the_maker_states():
    ahead = settle(1.0)
    assert ahead.speed_rpm == pytest.approx(3500, rel=0.02)
    assert ahead.supply_a == pytest.approx(24.0, rel=0.05)
    assert T200.thrust_n(ahead.speed_rpm) / 9.81 == pytest.approx(5.25, rel=0.05)
    assert T200.thrust_n(settle(-1.0).speed_rpm) / 9.81 == pytest.approx(-4.1, rel=0.05)


@pytest.mark.parametrize("command", [-1.0, -0.6, -0.1, 0.08, 0.3, 0.9])
@pytest.mark.parametrize("supply_v", [12.0, 16.6])
def test_steady_state_balances_voltage(command, supply_v):
    state = settle(command, supply_v=supply_v)
    speed_rpm = abs(state.speed_rpm)
    torque = T200.torque_ahead_a_per_rpm2 if command > 0.0 else T200.torque_astern_a_per_rpm2
    current_a = T200.friction_a + torque * speed_rpm**2
    drive_v = speed_rpm / T200.speed_constant_rpm_per_v + T200.resistance_ohm * current_a
    assert drive_v == pytest.approx(T200.duty(command) * supply_v, rel=1e-6)
    assert state.supply_a == pytest.approx(T200.duty(command) * current_a, rel=1e-6)


@pytest.mark.parametrize("command", [0.0, 0.0625, -0.0625, 0.03])
def test_dead_band_stands_still(command):
    assert settle(command) == ThrusterState(0.0, 0.0, 0.0)


def test_commands_beyond_full_saturate():
    assert settle(1.7).speed_rpm == settle(1.0).speed_rpm


def test_reverse_is_weaker():
    assert 0.9 < -settle(-0.8).speed_rpm / settle(0.8).speed_rpm < 1.0


def test_sagging_supply_slows_down_without_a_fault():
    assert settle(0.7, supply_v=14.0).speed_rpm < 0.93 * settle(0.7, supply_v=16.0).speed_rpm


def test_time_constants_up_and_down():
    up_steps, down_steps = round(T200.spin_up_s / PERIOD_S), round(T200.coast_down_s / PERIOD_S)
    states = run([0.8] * 300 + [0.3] * 300, parameters=PROMPT)
    high, low = states[299].speed_rpm, states[-1].speed_rpm
    assert states[up_steps - 1].speed_rpm == pytest.approx(high * (1.0 - exp(-1.0)), rel=1e-6)
    assert states[299 + down_steps].speed_rpm == pytest.approx(low + (high - low) * exp(-1.0), rel=1e-6)


def test_integration_does_not_depend_on_the_step():
    coarse = run([0.8] * 5 + [-0.7] * 20, parameters=PROMPT, period_s=0.02)
    fine = run([0.8] * 20 + [-0.7] * 80, parameters=PROMPT, period_s=0.005)
    assert [state.speed_rpm for state in coarse] == pytest.approx([state.speed_rpm for state in fine[3::4]], rel=1e-9)


def test_delay_is_the_only_thing_that_it_says():
    late = run([0.5] * 50, parameters=replace(T200, delay_s=0.05))
    prompt = run([0.5] * 50, parameters=PROMPT)
    assert [state.speed_rpm for state in late[:5]] == [0.0] * 5
    assert late[5:] == prompt[:-5]


@pytest.mark.parametrize(
    ("kind", "severity", "slower", "more_current"),
    [
        (FaultType.ENTANGLED, 0.25, True, True),
        (FaultType.WORN, 0.1, True, False),
        (FaultType.PROPELLER_LOST, 1.0, False, False),
        (FaultType.BLOCKED, 1.0, True, True),
        (FaultType.DEAD, 1.0, True, False),
    ],
)
@pytest.mark.parametrize("command", [0.5, -0.5])
def test_signature_of_faults(kind, severity, slower, more_current, command):
    healthy, faulty = settle(command), settle(command, faults=[injected(kind, severity)])
    assert faulty.healthy_rpm == healthy.speed_rpm
    assert (abs(faulty.speed_rpm) < 0.98 * abs(healthy.speed_rpm)) is slower
    assert (abs(faulty.speed_rpm) > 1.02 * abs(healthy.speed_rpm)) is not slower
    assert (faulty.supply_a > 1.02 * healthy.supply_a) is more_current
    assert (faulty.supply_a < 0.98 * healthy.supply_a) is not more_current


@pytest.mark.parametrize("kind", [FaultType.ENTANGLED, FaultType.WORN])
@pytest.mark.parametrize("loss", [0.03, 0.07, 0.5, 0.95])
def test_severity_is_the_speed_lost_at_full_throttle(kind, loss):
    healthy, faulty = settle(1.0), settle(1.0, faults=[injected(kind, loss)])
    assert faulty.speed_rpm / healthy.speed_rpm == pytest.approx(1.0 - loss, rel=1e-6)


@pytest.mark.parametrize("kind", [FaultType.BLOCKED, FaultType.DEAD])
def test_blocked_and_dead_stand_still(kind):
    assert settle(0.6, faults=[injected(kind)]).speed_rpm == 0.0


def test_current_stays_within_the_limit_of_the_esc():
    blocked = settle(1.0, faults=[injected(FaultType.BLOCKED)])
    assert blocked.supply_a == pytest.approx(T200.current_limit_a)
    reversal = run([1.0] * 100 + [-1.0] * 50)
    assert all(0.0 <= state.supply_a <= T200.current_limit_a for state in reversal)


def test_a_ramp_grows_and_ends():
    fault = injected(FaultType.WORN, 0.4, onset_s=2.0, ramp_s=4.0, end_s=10.0)
    assert [fault.strength(t) for t in (1.9, 2.0, 3.0, 6.0, 9.9, 10.0)] == [0.0, 0.0, 0.1, 0.4, 0.4, 0.0]
    worse = injected(FaultType.WORN, 0.5, onset_s=5.0)
    assert strengths([fault, worse], 6.0) == {FaultType.WORN: 0.5}


def test_reports_are_noisy_in_whole_units_of_the_esc():
    thruster = SimulatedThruster(PERIOD_S, seed=5)
    reports = []
    for index in range(3000):
        thruster.step(index * PERIOD_S, 0.8, 16.0)
        if index >= 200:
            reports.append(thruster.measure(0.02).speed_rpm)
    units = np.array(reports) / T200.resolution_rpm
    assert np.allclose(units, np.round(units))
    assert np.mean(reports) == pytest.approx(thruster.state.speed_rpm, rel=1e-3)
    expected_rpm = np.hypot(T200.noise * thruster.state.speed_rpm, T200.resolution_rpm / 12**0.5)
    assert np.std(reports) == pytest.approx(expected_rpm, rel=0.1)


def test_frozen_sensor_repeats_itself_while_the_propeller_obeys():
    thruster = SimulatedThruster(PERIOD_S, seed=2, faults=[injected(FaultType.SENSOR_FROZEN, onset_s=1.0)])
    seen = []
    for index in range(200):
        thruster.step(index * PERIOD_S, 0.8 if index < 150 else 0.2, 16.0)
        seen.append(thruster.measure(0.02).speed_rpm)
    assert len(set(seen[100:])) == 1 < len(set(seen[50:100]))
    assert thruster.state.speed_rpm == thruster.state.healthy_rpm < 0.8 * seen[-1]


def test_dropped_pulses_lower_the_reading_by_their_share():
    thruster = SimulatedThruster(PERIOD_S, seed=3, faults=[injected(FaultType.SENSOR_DROPPING, 0.3)])
    seen = []
    for index in range(1000):
        thruster.step(index * PERIOD_S, 0.8, 16.0)
        seen.append(thruster.measure(0.02).speed_rpm)
    assert np.mean(seen[200:]) == pytest.approx(0.7 * thruster.state.speed_rpm, rel=0.02)


def test_the_same_seed_gives_the_same_reports():
    def reports(seed):
        thruster = SimulatedThruster(PERIOD_S, seed)
        for index in range(50):
            thruster.step(index * PERIOD_S, 0.8, 16.0)
            yield thruster.measure(0.02)

    assert list(reports(7)) == list(reports(7)) != list(reports(8))


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"severity": 0.96, "kind": FaultType.ENTANGLED}, "severity = 0.96: want above 0 and at most 0.95"),
        ({"severity": 1.1, "kind": FaultType.DEAD}, "at most 1.0"),
        ({"severity": 0.0, "kind": FaultType.DEAD}, "severity = 0.0"),
        ({"ramp_s": -1.0, "kind": FaultType.DEAD}, "ramp_s = -1.0"),
        ({"onset_s": float("nan"), "kind": FaultType.DEAD}, "onset_s = nan"),
        ({"end_s": 0.0, "kind": FaultType.DEAD}, "end_s = 0.0"),
    ],
)
def test_impossible_faults_are_refused(settings, says):
    with pytest.raises(ValueError, match=says):
        injected(**settings)


def test_a_period_of_zero_is_refused():
    with pytest.raises(ValueError, match=r"period_s = 0\.0"):
        SimulatedThruster(0.0, seed=0)
