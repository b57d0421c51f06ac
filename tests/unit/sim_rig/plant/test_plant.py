import numpy as np
import pytest

from sim_rig.offline_run import run_offline
from sim_rig.plant.plant import Plant, apply_start_ramp, count_substeps

EFFECTS = {
    "gas_spring": {"preload": 90.0, "length": 0.05},
    "seal_friction": {"sliding": 20.0, "peak": 10.0, "stribeck": 0.015},
    "clevis_backlash": {"gap": 2e-4},
    "force_delay": {"delay": 2.3e-3},
}


def effect(name):
    return [{"name": name, "parameters": EFFECTS[name]}]


@pytest.fixture(scope="module")
def plain(varied, strokes):
    return run_offline(varied(), strokes)


@pytest.fixture(scope="module")
def with_effect(varied, strokes):
    return {name: run_offline(varied(effects=effect(name)), strokes) for name in EFFECTS}


def test_advancing_sample_by_sample_gives_the_motion_of_a_whole_record(varied, strokes):
    command, drive = strokes.displacement[:201], strokes.drive[:200]
    whole = Plant(varied(), command[0], drive[0]).simulate(1e-3, command, drive)
    stepped = Plant(varied(), command[0], drive[0])
    force = [stepped.advance(1e-3, command[i + 1], drive[i]).force for i in range(200)]
    assert np.array_equal(np.concatenate(force), whole.force)


def test_the_plant_starts_settled(varied):
    truth = Plant(varied(), 0.005, 0.2).simulate(1e-3, np.full(101, 0.005), np.full(100, 0.2))
    assert np.ptp(truth.force) < 1e-9
    assert truth.force[0] == pytest.approx(800 * (truth.position[0] - 0.02))


def test_the_rod_droops_under_load(varied):
    soft = Plant(varied(actuator={"stiffness": 1e6}), 0.005).simulate(1e-3, np.full(11, 0.005), np.zeros(10))
    assert soft.position[-1] - 0.005 == pytest.approx(-soft.force[-1] / 1e6)


def test_the_actuator_lags_its_command_by_servo_and_command_lag(varied, strokes):
    truth = run_offline(varied(actuator={"start_ramp": 0.0, "stiffness": 1e12}), strokes).truth
    steady, command = truth.position[8000::8], strokes.displacement[1000:]
    carrier = np.exp(-4j * np.pi * strokes.time[1000:])
    lag = np.angle(np.sum(command * carrier) / np.sum(steady * carrier)) / (4 * np.pi)
    assert lag == pytest.approx(2e-3 + 2 * 0.8 / (2 * np.pi * 40), rel=0.02)


def test_a_start_ramp_fades_the_motion_in_from_its_first_position(varied, strokes):
    faded = apply_start_ramp(varied(actuator={"start_ramp": 0.5}), strokes.time, strokes.displacement + 0.002)
    assert faded[0] == 0.002
    assert np.allclose(faded[500:], strokes.displacement[500:] + 0.002)
    assert np.abs(np.diff(faded, 2)).max() < 4e-6


def test_the_field_follows_a_step_of_the_drive_with_eta(plain):
    rise = (plain.truth.field[1600] - 0.1) / 0.3
    assert rise == pytest.approx(1 - np.exp(-80 * 0.1), abs=2e-3)


def test_the_damper_warms_by_what_it_dissipates(plain, strokes):
    work = np.sum(plain.truth.force[::8] * plain.truth.damper_velocity) * 1e-3
    coil = np.sum(plain.truth.output**2 / 5) * 1e-3
    assert plain.truth.temperature[-1] - 22 == pytest.approx((work + coil) / 600, rel=0.05)


def test_a_gas_spring_pushes_more_in_compression_than_it_pulls_in_extension(plain, with_effect):
    extra = with_effect["gas_spring"].truth.force - plain.truth.force
    x = plain.truth.position
    assert extra[x.argmin()] < -2 * 10
    assert abs(extra[x.argmin()]) > 1.2 * extra[x.argmax()] > 0


def test_seal_friction_follows_the_sign_of_the_velocity_and_is_largest_near_rest(plain, with_effect):
    result = with_effect["seal_friction"]
    extra = (result.truth.force - plain.truth.force)[::8]
    fast = np.abs(plain.truth.damper_velocity) > 0.09
    slow = (np.abs(plain.truth.damper_velocity) > 0.004) & (np.abs(plain.truth.damper_velocity) < 0.006)
    assert np.mean(np.abs(extra[fast])) == pytest.approx(20, abs=1)
    assert np.mean(np.abs(extra[slow & (result.time > 1.0)])) > 24


def test_with_backlash_the_damper_stays_while_the_pin_crosses_the_gap(with_effect):
    truth = with_effect["clevis_backlash"].truth
    position, damper = truth.position[::8], truth.damper_displacement
    assert np.abs(position - damper).max() == pytest.approx(1e-4, rel=1e-6)
    crossing = np.abs(position - damper) < 0.9e-4
    assert crossing.sum() > 20
    assert np.all(truth.damper_velocity[crossing] == 0)


def test_force_delay_shifts_the_force_channel_by_fractions_of_a_sample(plain, with_effect):
    late, force = with_effect["force_delay"].channels["force"], plain.truth.force
    fine = np.arange(len(force)) / 8e3
    assert np.allclose(late[100:], np.interp(plain.time[100:] - 2.3e-3, fine, force), atol=0.15)
    assert np.array_equal(with_effect["force_delay"].truth.force, force)


def test_parallel_effects_add_up(varied, strokes, plain, with_effect):
    both = run_offline(varied(effects=effect("gas_spring") + effect("seal_friction")), strokes).truth.force
    alone = sum(with_effect[name].truth.force - plain.truth.force for name in ("gas_spring", "seal_friction"))
    assert np.abs(both - plain.truth.force - alone).max() < 1.0


def test_a_fully_compressed_gas_column_is_a_stop(varied):
    short = varied(effects=[{"name": "gas_spring", "parameters": {"preload": 90.0, "length": 0.006}}])
    truth = Plant(short, -0.01).simulate(1e-3, np.full(3, -0.01), np.zeros(2))
    assert truth.force[0] < -10_000


@pytest.mark.parametrize(("dt", "substeps"), [(1e-3, 8), (2.5e-4, 2), (1e-4, 2), (4e-3, 32)])
def test_a_substep_is_at_most_an_eighth_of_a_millisecond(dt, substeps):
    assert count_substeps(dt) == substeps
